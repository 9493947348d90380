// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_stage.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/range_estimator.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Options of EdgeCompensator.
struct EdgeCompensatorOptions {
  std::size_t samples = 20;              ///< features of FP_object to estimate the ranges from
  std::uint64_t seed = 0;                ///< seed of the random sample
  RangeEstimatorOptions depth = {0.10};  ///< of the depth range, in metres
  RangeEstimatorOptions code = {16.0};   ///< of the range of codes, which go from 0 to 255
  /// Whether eq. (1) tests codes; false: its range of depth decides alone, as without an image.
  bool uses_codes = true;

  /// Returns the paper's rule, with values of ours where the paper gives none (see the map of the
  /// code, include/dynfilter/README.md, "The algorithm, made exact"). They will not change; the
  /// defaults equal them today and may.
  static EdgeCompensatorOptions paper() { return {}; }
};

/// Removes the edge features of dynamic objects that their masks missed (paper section 3.2).
///
/// A sample of FP_object, the features on an object's mask, gives its ranges of depth and of D-LBP
/// codes. A feature p in the object's box joins the object by eq. (1):
///
///     depth(p) in [a, b]_depth  and  D-LBP(p) in [a, b]_D-LBP
///
/// A value that is missing lies in no range. Without a depth image, the depths of the features
/// (FeaturesView::with_depths) decide alone. The statistics say where the stage abstained, see
/// Compensation. Where boxes overlap, a feature joins the first instance by whose ranges it passes.
class EdgeCompensator {
 public:
  /// Takes the options. Throws std::invalid_argument for options that FeatureSampler
  /// or RangeEstimator refuses, and for fewer samples than a range needs.
  explicit EdgeCompensator(const EdgeCompensatorOptions& options = {})
      : sampler_(options.samples, options.seed),
        depth_range_(options.depth),
        code_range_(options.code),
        uses_codes_(options.uses_codes) {
    if (options.samples < RangeEstimator::min_samples) {
      detail::throw_misuse("EdgeCompensator", detail::concatenate("samples = ", options.samples),
                           detail::concatenate("at least ", RangeEstimator::min_samples));
    }
  }

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage. Throws std::invalid_argument for labels of another input. O(features), and for
  /// each instance O(features near its box).
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "EdgeCompensator");
    Scratch& scratch = workspace.get<Scratch>();
    scratch.reserve(labels.size(), sampler_.samples());
    detail::report_missing_mask_stage(input.index, input.segmentation, labels);
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      if (!labels.is_dynamic_object(k)) continue;
      Compensation& outcome = labels.statistics().instances[k].compensation;
      outcome = estimate_ranges(input, k, labels, scratch);
      if (outcome == Compensation::applied || outcome == Compensation::applied_without_image) {
        compensate(input, k, labels);
      }
    }
  }

 private:
  struct Scratch {
    std::vector<SampleCandidate> candidates;
    std::vector<double> depths_m, codes;  // values of the sample

    void reserve(std::size_t features, std::size_t samples) {
      candidates.reserve(features);
      depths_m.reserve(std::min(features, samples));
      codes.reserve(std::min(features, samples));
    }
  };

  /// Estimates [a, b]_depth and [a, b]_D-LBP of object k from a sample of its masked features.
  Compensation estimate_ranges(const FilterInput& input, std::size_t k, FeatureLabels& labels,
                               Scratch& scratch) const {
    InstanceStatistics& statistics = labels.statistics().instances[k];
    const bool has_image = !input.frame.depth.empty();
    if (!has_image && !input.features.has_depths()) return Compensation::no_depth_image;
    draw_sample(input, k, labels, scratch.candidates);
    scratch.depths_m.clear();
    scratch.codes.clear();
    for (const SampleCandidate& candidate : scratch.candidates) {
      scratch.depths_m.push_back(candidate.depth_m);
      if (!has_image || !uses_codes_) continue;
      const auto code = depth_lbp_.code(input.frame.depth, input.index.pixel(candidate.feature));
      if (code) scratch.codes.push_back(*code);
    }
    statistics.sampled = scratch.candidates.size();
    statistics.depth_range_m = depth_range_.estimate_in_place(scratch.depths_m);
    statistics.code_range = code_range_.estimate_in_place(scratch.codes);
    ValueRange& codes = statistics.code_range;
    codes = {std::max(codes.lower, 0.0), std::min(codes.upper, 255.0)};
    if (codes.contains(0) && codes.contains(255)) ++labels.statistics().full_code_ranges;
    if (statistics.depth_range_m.empty()) return Compensation::too_few_samples;
    if (!has_image) return Compensation::applied_without_image;
    const bool lacks_codes = uses_codes_ && statistics.code_range.empty();
    return lacks_codes ? Compensation::too_few_samples : Compensation::applied;
  }

  /// Draws from the features of FP_object that lie on the mask and have depth.
  void draw_sample(const FilterInput& input, std::size_t k, const FeatureLabels& labels,
                   std::vector<SampleCandidate>& candidates) const {
    const Instance& instance = input.segmentation.instances[k];
    const cv::Rect masked(instance.mask_origin, instance.mask.size());
    candidates.clear();
    for (const std::size_t i : input.index.inside(masked)) {
      const FeatureLabel& label = labels[i];
      const bool is_masked = label.removed && label.reason == Reason::in_mask &&
                             label.instance == static_cast<std::int32_t>(k);
      if (!is_masked) continue;
      const cv::Point pixel = input.index.pixel(i);
      if (!instance.covers(pixel)) continue;
      const std::optional<double> depth_m = input.depth_m(i);
      if (!depth_m) continue;
      candidates.push_back({detail::wrapping_difference(pixel, instance.box.tl()), i, *depth_m});
    }
    sampler_.draw(input.frame.id, k, candidates);
  }

  /// Applies eq. (1), or its test of depth alone, to every feature in the box that is not removed
  /// yet.
  void compensate(const FilterInput& input, std::size_t k, FeatureLabels& labels) const {
    const Instance& instance = input.segmentation.instances[k];
    const InstanceStatistics& statistics = labels.statistics().instances[k];
    const bool has_codes = !input.frame.depth.empty() && uses_codes_;
    for (const std::size_t i : input.index.inside(instance.box)) {
      if (labels.is_removed(i)) continue;
      const bool joins =
          fits(statistics.depth_range_m, input.depth_m(i)) &&
          (!has_codes ||
           fits(statistics.code_range, depth_lbp_.code(input.frame.depth, input.index.pixel(i))));
      if (!joins) continue;
      labels.remove(i, static_cast<std::int32_t>(k), Reason::compensated, instance.score);
    }
  }

  /// Whether a value is known and lies in an object's range.
  template <class Value>
  static bool fits(const ValueRange& range, const std::optional<Value>& value) {
    return value && range.contains(*value);
  }

  FeatureSampler sampler_;
  RangeEstimator depth_range_;
  RangeEstimator code_range_;
  DepthLbp depth_lbp_;
  bool uses_codes_;
};

}  // namespace dynfilter
