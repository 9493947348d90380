// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EDGE_COMPENSATOR_HPP
#define DYNFILTER_EDGE_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/feature_lists.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/range_estimator.hpp"
#include "dynfilter/stage.hpp"
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

  /// O(features x instances), 64 features at a time, and for those in a box the pixels round each.
  /// Throws std::invalid_argument for malformed input.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "EdgeCompensator");
    if (input.frame.depth.empty()) {
      for_each_object(labels, [](std::size_t, InstanceStatistics& statistics) {
        statistics.compensation = Compensation::no_depth_image;
      });
      return;
    }
    reserve(input.features.size(), workspace);
    const FeaturePixels& pixels = pixels_of(input, workspace);
    const detail::MaskedFeatures masked(labels, workspace.masked_first, workspace.masked_next);
    detail::with_depth_image(input.frame, [&](const auto& image) {
      for_each_object(labels, [&](std::size_t k, InstanceStatistics& statistics) {
        SampleCandidate* const sample = workspace.candidates.data();
        SampleCandidate* const end = collect_candidates(image, input, k, pixels, masked, sample);
        estimate_ranges(image, input, pixels, sample, sampler_.draw(sample, end), workspace,
                        statistics);
        if (statistics.compensation != Compensation::applied) return;
        compensate(image, input, k, pixels, labels, workspace);
      });
    });
  }

 private:
  static void reserve(std::size_t features, Workspace& workspace) {
    // One more: what is no candidate is written behind the last that is one.
    if (workspace.candidates.size() <= features) workspace.candidates.resize(features + 1);
    workspace.depths_m.reserve(features);
    workspace.codes.reserve(features);
  }

  /// Those that are dynamic, or whose features somebody takes for dynamic.
  template <class Action>
  static void for_each_object(FeatureLabels& labels, const Action& action) {
    std::vector<InstanceStatistics>& instances = labels.statistics().instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (instances[k].dynamic || instances[k].masked > 0) action(k, instances[k]);
    }
  }

  /// The features of FP_object that have depth, put where `end` points; returns where they end.
  template <class Image>
  SampleCandidate* collect_candidates(const Image& image, const FilterInput& input, std::size_t k,
                                      const FeaturePixels& pixels,
                                      const detail::MaskedFeatures& masked,
                                      SampleCandidate* end) const {
    const Instance& instance = input.segmentation.instances[k];
    const std::uint64_t instance_hash = sampler_.instance_hash(input.frame.id, k);
    masked.for_each_of(k, [&](std::size_t i) { image.prefetch(pixels[i], 0); });
    masked.for_each_of(k, [&](std::size_t i) {
      const cv::Point pixel = pixels[i];
      end->pixel = detail::wrapping_difference(pixel, instance.box.tl());
      end->key = FeatureSampler::key(instance_hash, end->pixel);
      end->feature = i;
      // Whether it is a candidate adds up, for a branch would hang on what nobody can foresee.
      const int is_on_mask = instance.covers(pixel) ? 1 : 0;
      end += is_on_mask & (image.read(pixel).is_known ? 1 : 0);
    });
    return end;
  }

  /// [a, b]_depth and [a, b]_D-LBP from a sample of FP_object.
  template <class Image>
  void estimate_ranges(const Image& image, const FilterInput& input, const FeaturePixels& pixels,
                       const SampleCandidate* sample, const SampleCandidate* sample_end,
                       Workspace& workspace, InstanceStatistics& statistics) const {
    workspace.depths_m.clear();
    workspace.codes.clear();
    statistics.sampled = static_cast<std::size_t>(sample_end - sample);
    for (; sample != sample_end; ++sample) {
      const cv::Point pixel = pixels[sample->feature];
      workspace.depths_m.push_back(image.read(pixel).metres);
      const auto code = depth_lbp_.code(input.frame.depth, pixel);
      if (code) workspace.codes.push_back(*code);
    }
    statistics.depth_range_m = depth_estimator_.estimate(workspace.depths_m);
    statistics.code_range = code_estimator_.estimate(workspace.codes);
    const bool is_known = !statistics.depth_range_m.empty() && !statistics.code_range.empty();
    statistics.compensation = is_known ? Compensation::applied : Compensation::too_few_samples;
  }

  /// Eq. (1) for every feature in the box that is not removed yet.
  template <class Image>
  void compensate(const Image& image, const FilterInput& input, std::size_t k,
                  const FeaturePixels& pixels, FeatureLabels& labels, Workspace& workspace) const {
    const Instance& instance = input.segmentation.instances[k];
    InstanceStatistics& statistics = labels.statistics().instances[k];
    const ValueRange depth_range = statistics.depth_range_m, code_range = statistics.code_range;
    auto features = detail::kept_inside(pixels, labels, instance.box, workspace.features);
    statistics.candidates = features.size();
    for (const std::size_t i : features) image.prefetch(pixels[i], 1);
    std::size_t passed_depth = 0, passed_code = 0;
    features.leave_only([&](std::size_t i) {
      const auto depth = image.read(pixels[i]);
      const auto code = depth_lbp_.code(input.frame.depth, pixels[i]);
      const bool depth_fits = fits(depth.is_known, depth.metres, depth_range);
      const bool code_fits = fits(code.has_value(), code.value_or(0), code_range);
      passed_depth += depth_fits ? 1 : 0;
      passed_code += code_fits ? 1 : 0;
      return depth_fits && code_fits;
    });
    statistics.passed_depth = passed_depth;
    statistics.passed_code = passed_code;
    labels.remove_all(features, static_cast<std::int32_t>(k), Reason::compensated, instance.score);
  }

  bool fits(bool is_known, double value, const ValueRange& range) const {
    return is_known ? range.contains(value) : passes_without_value_;
  }

  FeatureSampler sampler_;
  RangeEstimator depth_estimator_;
  RangeEstimator code_estimator_;
  DepthLbp depth_lbp_;
  bool passes_without_value_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_EDGE_COMPENSATOR_HPP
