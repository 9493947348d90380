// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Checks of the filter's labels, made before anything is timed.

#pragma once

#include <cstddef>
#include <string>

#include "dynfilter/dynfilter.hpp"
#include "filter_input.hpp"
#include "support/filter_property.hpp"

namespace dynfilter::benchmarks {

/// Checks what holds for every rule: each masked feature has the instance that
/// MaskCuller::instance_at finds, and each compensated one has an object's depth and place. Returns
/// the first fault, or nothing. O(features x instances).
inline std::string check_labels(const FilterInputData& input, const FeatureLabels& labels) {
  const MaskCuller culler;
  std::size_t removed = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const FeatureLabel& label = labels[i];
    const auto owner = culler.instance_at(input.segmentation, input.keypoints[i].pt);
    const bool is_masked = label.removed && label.reason == Reason::in_mask;
    if (owner.has_value() != is_masked) return "a feature on a mask that is not masked";
    if (owner && *owner != label.instance) return "a masked feature of another instance";
    removed += label.removed ? 1 : 0;
    if (!label.removed || is_masked) continue;
    const cv::Rect box = input.segmentation.instances[static_cast<std::size_t>(label.instance)].box;
    const cv::Rect reach =
        detail::clip_grown(box, 6 * input.frame.depth.cols / 640 + 1,
                           6 * input.frame.depth.cols / 640 + 1, input.frame.depth.size());
    if (!reach.contains(nearest_pixel(input.keypoints[i].pt))) return "a feature beyond its box";
  }
  const FrameStatistics& statistics = labels.statistics();
  if (statistics.removed() != removed) return "counts that do not add up";
  const bool has_persons = !input.segmentation.instances.empty();
  if (has_persons && statistics.masked == 0) return "an input on which nothing happens";
  return {};
}

/// Checks the same, and compares every label with the rule's oracle if the frame is small enough.
inline std::string check_labels(const FilterInputData& input, const DynamicFilterOptions& options,
                                const FeatureLabels& labels) {
  const double work =
      static_cast<double>(input.frame.depth.total()) *
      static_cast<double>(input.keypoints.size() * input.segmentation.instances.size());
  if (work < 1e9) {
    const testing::OracleVerdict verdict =
        testing::expected_verdict({input.frame, input.segmentation, input.keypoints, options});
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (!testing::same_label(labels[i], verdict.labels[i]))
        return "another label than the oracle";
    }
  }
  return check_labels(input, labels);
}

}  // namespace dynfilter::benchmarks
