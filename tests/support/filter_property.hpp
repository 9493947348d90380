// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "dynfilter/dynfilter.hpp"
#include "support/depth_rule_oracle.hpp"
#include "support/filter_case.hpp"
#include "support/oracle.hpp"

namespace dynfilter::testing {

inline std::string describe(const FeatureLabel& label) {
  return detail::concatenate("reason ", static_cast<int>(label.reason), ", instance ",
                             label.instance, ", score ", label.score,
                             label.removed ? ", removed" : ", kept");
}

inline bool same_counts(const InstanceStatistics& a, const InstanceStatistics& b) {
  return a.class_id == b.class_id && a.dynamic == b.dynamic && a.masked == b.masked &&
         a.compensated == b.compensated;
}

inline bool same_range(const ValueRange& a, const ValueRange& b) {
  return (a.empty() && b.empty()) ||
         (std::abs(a.lower - b.lower) < 1e-9 && std::abs(a.upper - b.upper) < 1e-9);
}

/// Compares the statistics that only DepthCompensator fills in.
inline bool same_object(const InstanceStatistics& a, const InstanceStatistics& b) {
  return a.sampled == b.sampled && std::abs(a.mask_gap_px - b.mask_gap_px) < 1e-9 &&
         a.depth_shift_px == b.depth_shift_px && a.mask_gap_places == b.mask_gap_places &&
         a.compensation == b.compensation && same_range(a.depth_range_m, b.depth_range_m);
}

/// Verdict of the oracle of the input's rule.
inline OracleVerdict expected_verdict(const FilterCase& input) {
  switch (input.options.compensator.rule) {
    case CompensationRule::depth:
      return DepthRuleOracle(input).filter;
    case CompensationRule::paper:
      return oracle_filter(input);
    case CompensationRule::mask:
      break;
  }
  return oracle_masks(input);
}

/// Runs the filter on one input and compares every label and every instance's counts with the
/// oracle's, the totals with the labels, and the output of keep_static with the labels. Returns the
/// first difference, or nothing.
inline std::string check_filter(const FilterCase& input) {
  const FeatureLabels labels =
      DynamicFilter(input.options).apply(input.frame, input.segmentation, input.features());
  const OracleVerdict verdict = expected_verdict(input);
  const bool by_depth = input.options.compensator.rule == CompensationRule::depth;
  const std::vector<FeatureLabel>& expected = verdict.labels;
  if (labels.size() != expected.size()) return "wrong number of labels";
  std::size_t removed = 0, restored = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (!same_label(labels[i], expected[i])) {
      return detail::concatenate("feature ", i, ": got ", describe(labels[i]), "; want ",
                                 describe(expected[i]));
    }
    removed += labels.is_removed(i) ? 1 : 0;
    restored += labels[i].reason == Reason::restored ? 1 : 0;
  }
  const FrameStatistics& statistics = labels.statistics();
  if (statistics.has_depth == input.frame.depth.empty()) return "wrong has_depth";
  const bool is_starved = labels.size() - removed < input.options.feature_floor;
  if (statistics.starved != is_starved) return "wrong starved";
  for (std::size_t k = 0; k < verdict.instances.size(); ++k) {
    if (!same_counts(statistics.instances[k], verdict.instances[k])) {
      return detail::concatenate("wrong counts for instance ", k);
    }
    if (by_depth && !same_object(statistics.instances[k], verdict.instances[k])) {
      return detail::concatenate("wrong depths for instance ", k);
    }
  }
  if (statistics.restored != restored) return "wrong number of restored features";
  if (statistics.removed() != removed || statistics.kept() + removed != labels.size()) {
    return "the counts do not add up";
  }
  std::vector<int> ids(labels.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<int>(i);
  keep_static(labels, ids);
  if (ids.size() != labels.size() - removed) return "keep_static kept a wrong number of features";
  for (const int id : ids) {
    if (labels.is_removed(static_cast<std::size_t>(id)))
      return "keep_static kept a removed feature";
  }
  return {};
}

}  // namespace dynfilter::testing
