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
#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/on_mask.hpp"
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
    reserve(input.features.size(), workspace);
    const FeaturePixels& pixels = pixels_of(input, workspace);
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      InstanceStatistics& statistics = labels.statistics().instances[k];
      if (!statistics.dynamic && statistics.masked == 0) continue;
      if (input.frame.depth.empty()) {
        statistics.compensation = Compensation::no_depth_image;
        continue;
      }
      detail::with_depth_image(input.frame, [&](const auto& image) {
        statistics.compensation = estimate_ranges(image, input, k, pixels, labels, workspace);
        if (statistics.compensation != Compensation::applied) return;
        compensate(image, input, k, pixels, labels);
      });
    }
  }

 private:
  static void reserve(std::size_t features, Workspace& workspace) {
    workspace.candidates.reserve(features);
    workspace.depths_m.reserve(features);
    workspace.codes.reserve(features);
  }

  /// [a, b]_depth and [a, b]_D-LBP from a sample of FP_object.
  template <class Image>
  Compensation estimate_ranges(const Image& image, const FilterInput& input, std::size_t k,
                               const FeaturePixels& pixels, FeatureLabels& labels,
                               Workspace& workspace) const {
    collect_candidates(image, input, k, pixels, labels, workspace.candidates);
    sampler_.draw(workspace.candidates);
    workspace.depths_m.clear();
    workspace.codes.clear();
    for (const SampleCandidate& sample : workspace.candidates) {
      const cv::Point pixel = pixels[sample.feature];
      workspace.depths_m.push_back(image.metres_or_nan(pixel));
      const auto code = depth_lbp_.code(input.frame.depth, pixel);
      if (code) workspace.codes.push_back(*code);
    }
    InstanceStatistics& statistics = labels.statistics().instances[k];
    statistics.sampled = workspace.candidates.size();
    statistics.depth_range_m = depth_estimator_.estimate(workspace.depths_m);
    statistics.code_range = code_estimator_.estimate(workspace.codes);
    return statistics.depth_range_m.empty() || statistics.code_range.empty()
               ? Compensation::too_few_samples
               : Compensation::applied;
  }

  /// The features of FP_object that have depth.
  template <class Image>
  void collect_candidates(const Image& image, const FilterInput& input, std::size_t k,
                          const FeaturePixels& pixels, const FeatureLabels& labels,
                          std::vector<SampleCandidate>& candidates) const {
    const Instance& instance = input.segmentation.instances[k];
    const std::uint64_t instance_hash = sampler_.instance_hash(input.frame.id, k);
    candidates.clear();
    for (std::size_t block = 0; block < pixels.blocks(); ++block) {
      const std::uint64_t covered = detail::on_mask(pixels, block, labels.removed_bits(block),
                                                    instance.mask, instance.mask_origin);
      detail::for_each_bit(covered, [&](std::size_t j) {
        const std::size_t i = block * detail::block_size + j;
        const FeatureLabel& label = labels[i];
        const bool on_object =
            label.reason == Reason::in_mask && label.instance == static_cast<std::int32_t>(k);
        if (!on_object || std::isnan(image.metres_or_nan(pixels[i]))) return;
        const cv::Point in_box = detail::wrapping_difference(pixels[i], instance.box.tl());
        candidates.push_back({FeatureSampler::key(instance_hash, in_box), in_box, i});
      });
    }
  }

  /// Eq. (1) for every feature in the box that is not removed yet.
  template <class Image>
  void compensate(const Image& image, const FilterInput& input, std::size_t k,
                  const FeaturePixels& pixels, FeatureLabels& labels) const {
    const Instance& instance = input.segmentation.instances[k];
    InstanceStatistics& statistics = labels.statistics().instances[k];
    const ValueRange depth_range = statistics.depth_range_m, code_range = statistics.code_range;
    std::size_t candidates = 0, passed_depth = 0, passed_code = 0;
    for (std::size_t block = 0; block < pixels.blocks(); ++block) {
      const std::uint64_t in_box = pixels.inside(block, instance.box) & ~labels.removed_bits(block);
      std::uint64_t passed_both = 0;
      detail::for_each_bit(in_box, [&](std::size_t j) {
        const cv::Point pixel = pixels[block * detail::block_size + j];
        const bool depth_fits = fits(image.metres_or_nan(pixel), depth_range);
        const bool code_fits = fits(code_or_nan(input.frame.depth, pixel), code_range);
        passed_depth += depth_fits ? 1 : 0;
        passed_code += code_fits ? 1 : 0;
        passed_both |= std::uint64_t{depth_fits && code_fits} << j;
      });
      candidates += detail::count_bits(in_box);
      labels.remove_bits(block, passed_both, static_cast<std::int32_t>(k), Reason::compensated,
                         instance.score);
    }
    statistics.candidates = candidates;
    statistics.passed_depth = passed_depth;
    statistics.passed_code = passed_code;
  }

  double code_or_nan(const cv::Mat& depth, cv::Point pixel) const {
    const auto code = depth_lbp_.code(depth, pixel);
    return code ? static_cast<double>(*code) : std::numeric_limits<double>::quiet_NaN();
  }

  /// NaN is no value.
  bool fits(double value, const ValueRange& range) const {
    return range.contains(value) || (passes_without_value_ && std::isnan(value));
  }

  FeatureSampler sampler_;
  RangeEstimator depth_estimator_;
  RangeEstimator code_estimator_;
  DepthLbp depth_lbp_;
  bool passes_without_value_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_EDGE_COMPENSATOR_HPP
