// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EDGE_COMPENSATOR_HPP
#define DYNFILTER_EDGE_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/depth_reader.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/detail/likely_samples.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/detail/sample_lanes.hpp"
#include "dynfilter/feature_list.hpp"
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
    const detail::LikelySamples samples(sampler_, input, labels, pixels, instruction_set_,
                                        workspace.likely_samples);
    detail::with_depth_image(input.frame, [&](const auto& image) {
      const detail::DepthReader reader(image, depth_lbp_, input.frame.depth, pixels);
      ObjectGroup group;
      for_each_object(labels, [&](std::size_t k, InstanceStatistics&) {
        group.add(k);
        if (!group.is_full()) return;
        compensate(reader, input, group, samples, labels, workspace);
        group = {};
      });
      compensate(reader, input, group, samples, labels, workspace);
    });
  }

 private:
  static void reserve(std::size_t features, Workspace& workspace) {
    if (workspace.candidates.size() < features) workspace.candidates.resize(features);
    workspace.readings.reserve(features);
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

  struct Sample {
    const SampleCandidate* first;
    const SampleCandidate* last;

    const SampleCandidate* begin() const { return first; }
    const SampleCandidate* end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
  };

  /// Of the features of FP_object that have depth; a candidate's feature is the index of its
  /// reading.
  template <class Reader>
  Sample draw(const Reader& reader, const Instance& instance, std::size_t k,
              const detail::LikelySamples& samples, Workspace& workspace) const {
    SampleCandidate* const begin = workspace.candidates.data();
    SampleCandidate* end = read_candidates(reader, instance, samples, samples.likely(k), workspace);
    if (static_cast<std::size_t>(end - begin) < sampler_.samples() && !samples.are_all(k)) {
      end = read_candidates(reader, instance, samples, samples.all(k), workspace);
    }
    return {begin, sampler_.draw(begin, end)};
  }

  /// Reads at features on the mask and makes candidates of those that have depth; returns where
  /// these end.
  template <class Reader>
  SampleCandidate* read_candidates(const Reader& reader, const Instance& instance,
                                   const detail::LikelySamples& samples,
                                   const detail::LikelySamples::Places& places,
                                   Workspace& workspace) const {
    const cv::Point* const pixel_of = samples.pixels();
    const std::uint64_t* const key_of = samples.keys();
    reader.codes.read(reader.pixels.bounds(), pixel_of, places.begin(), places.end(),
                      instruction_set_, workspace.readings);
    const std::uint32_t* const depth_bits = workspace.readings.depth_bits.data();
    const detail::NumberRange known_depths = reader.known_depths;
    const cv::Point corner = instance.box.tl();
    SampleCandidate* end = workspace.candidates.data();
    std::size_t reading = 0;
    for (const std::uint32_t place : places) {
      const bool has_depth = known_depths.contains(depth_bits[reading]);
      *end = {key_of[place], detail::wrapping_difference(pixel_of[place], corner), reading++};
      end += has_depth ? 1 : 0;
    }
    return end;
  }

  /// Objects whose samples are sorted at once: each takes two lanes.
  class ObjectGroup {
   public:
    void add(std::size_t instance) { instances_[size_++] = instance; }
    bool is_full() const { return size_ == instances_.size(); }
    std::size_t size() const { return size_; }
    std::size_t operator[](std::size_t j) const { return instances_[j]; }

   private:
    std::array<std::size_t, detail::sample_lanes / 2> instances_{};
    std::size_t size_ = 0;
  };

  template <class Reader>
  void compensate(const Reader& reader, const FilterInput& input, const ObjectGroup& group,
                  const detail::LikelySamples& samples, FeatureLabels& labels,
                  Workspace& workspace) const {
    if (group.size() == 0) return;
    const std::size_t most = std::min(sampler_.samples(), labels.size());
    detail::SampleLanes lanes(workspace.lanes, most);
    for (std::size_t j = 0; j < group.size(); ++j) {
      const Instance& instance = input.segmentation.instances[group[j]];
      const Sample sample = draw(reader, instance, group[j], samples, workspace);
      labels.statistics().instances[group[j]].sampled = sample.size();
      fill_lanes(reader, sample, workspace.readings, j, lanes);
    }
    lanes.sort(instruction_set_);
    for (std::size_t j = 0; j < group.size(); ++j) {
      InstanceStatistics& statistics = labels.statistics().instances[group[j]];
      estimate_ranges(reader, lanes, j, workspace, statistics);
      if (statistics.compensation != Compensation::applied) continue;
      compensate(reader, input, group[j], labels, workspace);
    }
  }

  /// Lane 2 j has the bits of the depths of the j-th object of a group, lane 2 j + 1 the codes.
  template <class Reader>
  static void fill_lanes(const Reader& reader, const Sample& sample,
                         const detail::DepthReadings& readings, std::size_t j,
                         detail::SampleLanes& lanes) {
    for (const SampleCandidate& candidate : sample) {
      const detail::PixelReading reading = {readings.depth_bits[candidate.feature],
                                            readings.codes[candidate.feature]};
      lanes.add_if(true, 2 * j, reading.depth_bits);
      lanes.add_if(reader.codes.has_code(reading), 2 * j + 1, reading.code);
    }
  }

  /// [a, b]_depth and [a, b]_D-LBP from a sample of FP_object.
  template <class Reader>
  void estimate_ranges(const Reader& reader, const detail::SampleLanes& lanes, std::size_t j,
                       Workspace& workspace, InstanceStatistics& statistics) const {
    lanes.transform(2 * j, workspace.depths_m,
                    [&](std::uint32_t bits) { return reader.image.metres_of_bits(bits); });
    lanes.transform(2 * j + 1, workspace.codes,
                    [](std::uint32_t code) { return static_cast<double>(code); });
    statistics.depth_range_m = depth_estimator_.range_of(workspace.depths_m);
    statistics.code_range = code_estimator_.range_of(workspace.codes);
    const bool is_known = !statistics.depth_range_m.empty() && !statistics.code_range.empty();
    statistics.compensation = is_known ? Compensation::applied : Compensation::too_few_samples;
  }

  /// Eq. (1) for every feature in the box that is not removed yet.
  template <class Reader>
  void compensate(const Reader& reader, const FilterInput& input, std::size_t k,
                  FeatureLabels& labels, Workspace& workspace) const {
    const Instance& instance = input.segmentation.instances[k];
    InstanceStatistics& statistics = labels.statistics().instances[k];
    FeatureList features =
        reader.pixels.inside(instance.box, labels.removed_bits(), workspace.features);
    statistics.candidates = features.size();
    reader.codes.read(reader.pixels.bounds(), reader.pixels.data(), features.begin(),
                      features.end(), instruction_set_, workspace.readings);
    leave_fitting(reader, workspace.readings, features, statistics);
    labels.remove_all(features, static_cast<std::int32_t>(k), Reason::compensated, instance.score);
  }

  /// Leaves the features whose readings, which stand in their order, lie in both ranges.
  template <class Reader>
  void leave_fitting(const Reader& reader, const detail::DepthReadings& readings,
                     FeatureList& features, InstanceStatistics& statistics) const {
    const detail::NumberRange depths = reader.image.bits_of(statistics.depth_range_m);
    const detail::NumberRange codes = whole_numbers_in(statistics.code_range);
    const std::uint32_t* depth_bits = readings.depth_bits.data();
    const std::uint16_t* code = readings.codes.data();
    const auto in_range = [&](const auto* numbers, const detail::NumberRange& range) {
      return detail::bits_in_range(numbers, range, instruction_set_);
    };
    std::size_t passed_depth = 0, passed_code = 0;
    features.leave_blocks([&](const std::uint32_t*, std::size_t count) {
      const std::uint64_t has_code = in_range(depth_bits, reader.depths_with_code());
      std::uint64_t depth_fits = in_range(depth_bits, depths);
      std::uint64_t code_fits = has_code & in_range(code, codes);
      if (passes_without_value_) {
        depth_fits |= ~in_range(depth_bits, reader.known_depths);
        code_fits |= ~(has_code & in_range(code, {0, 256}));
      }
      depth_bits += detail::block_size;
      code += detail::block_size;
      const std::uint64_t there = detail::bits_below(count);
      passed_depth += detail::count_bits(depth_fits & there);
      passed_code += detail::count_bits(code_fits & there);
      return depth_fits & code_fits;
    });
    statistics.passed_depth = passed_depth;
    statistics.passed_code = passed_code;
  }

  /// The codes in a range that is not empty.
  static detail::NumberRange whole_numbers_in(const ValueRange& range) {
    const double first = std::max(std::ceil(range.lower), 0.0);
    const double last = std::min(std::floor(range.upper), 255.0);
    if (first > last) return {};
    return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last - first) + 1};
  }

  FeatureSampler sampler_;
  RangeEstimator depth_estimator_;
  RangeEstimator code_estimator_;
  DepthLbp depth_lbp_;
  bool passes_without_value_;
  detail::InstructionSet instruction_set_ = detail::best_instruction_set();
};

}  // namespace dynfilter

#endif  // DYNFILTER_EDGE_COMPENSATOR_HPP
