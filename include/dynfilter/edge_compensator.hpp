// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EDGE_COMPENSATOR_HPP
#define DYNFILTER_EDGE_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <opencv2/core.hpp>

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/range_estimator.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// What becomes of a feature in the box that has no depth, or no D-LBP code.
enum class MissingDepth {
  keep,   ///< it fails the test that it has no value for, and stays
  remove  ///< it passes that test: the shadow beside a person has no depth
};

struct EdgeCompensatorOptions {
  std::size_t samples = 20;  ///< features of FP_object that tell the ranges
  std::uint64_t seed = 0;    ///< of the sample
  /// In metres.
  RangeEstimatorOptions depth = {OutlierRule::median_absolute_deviation, 3.0, 5, 0.10};
  /// In codes, 0 to 255.
  RangeEstimatorOptions code = {OutlierRule::median_absolute_deviation, 3.0, 5, 16.0};
  DepthLbpOptions depth_lbp;
  MissingDepth missing_depth = MissingDepth::keep;

  /// The paper's rule taken literally. The defaults are the same today and may become better ones;
  /// this stays.
  static EdgeCompensatorOptions paper() {
    EdgeCompensatorOptions options;
    options.samples = 20;
    options.depth = {OutlierRule::median_absolute_deviation, 3.0, 5, 0.10};
    options.code = {OutlierRule::median_absolute_deviation, 3.0, 5, 16.0};
    options.depth_lbp = {};
    options.missing_depth = MissingDepth::keep;
    return options;
  }
};

/// Removes the edge features of dynamic objects that their masks missed (paper section 3.2). The
/// features of FP_object, which an earlier stage removed as in_mask, tell the object's range of
/// depth and of D-LBP codes; a feature in its box whose depth and code both lie in them belongs to
/// the object, eq. (1).
///
/// It abstains, and says so in the statistics, without a depth image and where an instance has too
/// few masked features with depth. With overlapping boxes the first instance whose test a feature
/// passes has it. Features that a margin took beside the mask are not sampled. A removed feature's
/// score is the detector's confidence in the object.
class EdgeCompensator {
 public:
  /// Throws std::invalid_argument for options that FeatureSampler, RangeEstimator or DepthLbp
  /// refuse, and for fewer samples than a range needs.
  explicit EdgeCompensator(const EdgeCompensatorOptions& options = {})
      : sampler_(options.samples, options.seed),
        depth_estimator_(options.depth),
        code_estimator_(options.code),
        depth_lbp_(options.depth_lbp),
        passes_without_value_(options.missing_depth == MissingDepth::remove) {
    const std::size_t least = std::max(options.depth.least_samples, options.code.least_samples);
    if (options.samples < least) {
      detail::throw_misuse("EdgeCompensator", detail::concatenate("samples = ", options.samples),
                           detail::concatenate("at least least_samples, ", least));
    }
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// O(features x instances). Throws std::invalid_argument for malformed input.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "EdgeCompensator");
    prepare(input.features, workspace);
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      InstanceStatistics& statistics = labels.statistics().instances[k];
      if (!statistics.dynamic && statistics.masked == 0) continue;
      statistics.compensation = estimate_ranges(input, labels, k, workspace, statistics);
      if (statistics.compensation != Compensation::applied) continue;
      compensate(input, labels, k, workspace, statistics);
    }
  }

 private:
  static void prepare(FeaturesView features, Workspace& workspace) {
    workspace.candidates.reserve(features.size());
    workspace.depths_m.reserve(features.size());
    workspace.codes.reserve(features.size());
    detail::read_pixels(features, workspace);
  }

  /// [a, b]_depth and [a, b]_D-LBP from a sample of FP_object.
  Compensation estimate_ranges(const FilterInput& input, const FeatureLabels& labels, std::size_t k,
                               Workspace& workspace, InstanceStatistics& statistics) const {
    if (input.frame.depth.empty()) return Compensation::no_depth_image;
    collect_candidates(input, labels, k, workspace);
    sampler_.draw(workspace.candidates);
    statistics.sampled = workspace.candidates.size();
    workspace.depths_m.clear();
    workspace.codes.clear();
    for (const SampleCandidate& sample : workspace.candidates) {
      const cv::Point pixel = workspace.pixels[sample.feature];
      workspace.depths_m.push_back(*input.frame.depth_m(pixel));
      const auto code = depth_lbp_.code(input.frame.depth, pixel);
      if (code) workspace.codes.push_back(*code);
    }
    statistics.depth_range_m = depth_estimator_.estimate(workspace.depths_m);
    statistics.code_range = code_estimator_.estimate(workspace.codes);
    return statistics.depth_range_m.empty() || statistics.code_range.empty()
               ? Compensation::too_few_samples
               : Compensation::applied;
  }

  /// The features of FP_object that have depth.
  void collect_candidates(const FilterInput& input, const FeatureLabels& labels, std::size_t k,
                          Workspace& workspace) const {
    const Instance& instance = input.segmentation.instances[k];
    workspace.candidates.clear();
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      const cv::Point pixel = workspace.pixels[i];
      const bool on_object = label.removed && label.reason == Reason::in_mask &&
                             label.instance == static_cast<std::int32_t>(k) &&
                             instance.covers(pixel);
      if (!on_object || !input.frame.depth_m(pixel)) continue;
      const cv::Point in_box = detail::wrapping_difference(pixel, instance.box.tl());
      workspace.candidates.push_back({sampler_.key(input.frame.id, k, in_box), in_box, i});
    }
  }

  /// Eq. (1) for every feature in the box that is not removed yet.
  void compensate(const FilterInput& input, FeatureLabels& labels, std::size_t k,
                  const Workspace& workspace, InstanceStatistics& statistics) const {
    const Instance& instance = input.segmentation.instances[k];
    statistics.candidates = statistics.passed_depth = statistics.passed_code = 0;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::Point pixel = workspace.pixels[i];
      if (labels.is_removed(i) || !instance.box_contains(pixel)) continue;
      const bool depth_fits = fits(input.frame.depth_m(pixel), statistics.depth_range_m);
      const bool code_fits = fits(depth_lbp_.code(input.frame.depth, pixel), statistics.code_range);
      statistics.candidates += 1;
      statistics.passed_depth += depth_fits ? 1 : 0;
      statistics.passed_code += code_fits ? 1 : 0;
      if (!depth_fits || !code_fits) continue;
      labels.remove(i, static_cast<std::int32_t>(k), Reason::compensated, instance.score);
    }
  }

  template <class Value>
  bool fits(const std::optional<Value>& value, const ValueRange& range) const {
    return value ? range.contains(*value) : passes_without_value_;
  }

  FeatureSampler sampler_;
  RangeEstimator depth_estimator_;
  RangeEstimator code_estimator_;
  DepthLbp depth_lbp_;
  bool passes_without_value_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_EDGE_COMPENSATOR_HPP
