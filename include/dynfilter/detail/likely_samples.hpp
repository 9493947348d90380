// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Which features of FP_object may be drawn for a sample of it.

#ifndef DYNFILTER_DETAIL_LIKELY_SAMPLES_HPP
#define DYNFILTER_DETAIL_LIKELY_SAMPLES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/detail/sample_keys.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

/// What an instance's keys are made with, and which of them are likely.
struct InstanceKeys {
  std::uint64_t hash;
  cv::Point corner;  ///< of the box
  std::uint64_t high_key;
  std::uint32_t first;  ///< of the chain of its likely features
};

/// Memory that is kept between frames: what is known of each masked feature stands at the same
/// place in all of its arrays.
struct LikelySamplesMemory {
  std::vector<InstanceKeys> instances;
  std::vector<std::uint64_t> keys;
  std::vector<cv::Point> pixels;  // relative to the box
  std::vector<std::uint32_t> features, instance_of, next;
};

/// The features that were removed as in_mask, by their instance, and of those the ones with keys up
/// to FeatureSampler::high_key: one pass over the labels serves all instances.
class LikelySamples {
 public:
  LikelySamples(const FeatureSampler& sampler, const FilterInput& input,
                const FeatureLabels& labels, const FeaturePixels& pixels, InstructionSet best,
                LikelySamplesMemory& memory)
      : memory_(memory) {
    reserve(blocks_for(labels.size()) * block_size);
    read_instances(sampler, input, labels.statistics());
    read_masked(labels, pixels);
    for (std::size_t i = 0; i < count_; i += block_size) {
      make_keys(&memory.pixels[i], best, &memory.keys[i]);
    }
    chain_likely();
  }

  /// Whether the likely ones of an instance are all.
  bool are_all(std::size_t instance) const {
    return memory_.instances[instance].high_key == std::numeric_limits<std::uint64_t>::max();
  }

  /// Calls action(candidate) with the likely ones of an instance, in no particular order. O(their
  /// number).
  template <class Action>
  void for_each_likely(std::size_t instance, const Action& action) const {
    for (std::uint32_t i = memory_.instances[instance].first; i != none; i = memory_.next[i]) {
      action(candidate(i));
    }
  }

  /// The same with all of them. O(masked features).
  template <class Action>
  void for_each(std::size_t instance, const Action& action) const {
    for (std::size_t i = 0; i < count_; ++i) {
      if (memory_.instance_of[i] == instance) action(candidate(i));
    }
  }

 private:
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  SampleCandidate candidate(std::size_t i) const {
    return {memory_.keys[i], memory_.pixels[i], memory_.features[i]};
  }

  void reserve(std::size_t features) {
    if (memory_.keys.size() >= features) return;
    memory_.keys.resize(features);
    memory_.pixels.resize(features);
    memory_.features.resize(features);
    memory_.instance_of.resize(features);
    memory_.next.resize(features);
  }

  void read_instances(const FeatureSampler& sampler, const FilterInput& input,
                      const FrameStatistics& statistics) {
    memory_.instances.clear();
    for (std::size_t k = 0; k < statistics.instances.size(); ++k) {
      memory_.instances.push_back({sampler.instance_hash(input.frame.id, k),
                                   input.segmentation.instances[k].box.tl(),
                                   sampler.high_key(statistics.instances[k].masked), none});
    }
  }

  /// All but the keys: in their place the hashes of the instances.
  void read_masked(const FeatureLabels& labels, const FeaturePixels& pixels) {
    const cv::Point* const pixel_of = pixels.data();
    const InstanceKeys* const instances = memory_.instances.data();
    std::uint64_t* const keys = memory_.keys.data();
    cv::Point* const relative = memory_.pixels.data();
    std::uint32_t* const features = memory_.features.data();
    std::uint32_t* const instance_of = memory_.instance_of.data();
    std::size_t count = 0;
    const std::vector<std::uint64_t>& removed = labels.removed_bits();
    for (std::size_t block = 0; block < removed.size(); ++block) {
      for_each_bit(removed[block], [&](std::size_t bit) {
        const std::size_t i = block * block_size + bit;
        const FeatureLabel& label = labels[i];
        if (label.reason != Reason::in_mask || label.instance < 0) return;
        const InstanceKeys& instance = instances[label.instance];
        keys[count] = instance.hash;
        relative[count] = wrapping_difference(pixel_of[i], instance.corner);
        features[count] = static_cast<std::uint32_t>(i);
        instance_of[count] = static_cast<std::uint32_t>(label.instance);
        ++count;
      });
    }
    count_ = count;
  }

  void chain_likely() {
    InstanceKeys* const instances = memory_.instances.data();
    const std::uint64_t* const keys = memory_.keys.data();
    const std::uint32_t* const instance_of = memory_.instance_of.data();
    std::uint32_t* const next = memory_.next.data();
    for (std::size_t i = 0; i < count_; ++i) {
      InstanceKeys& instance = instances[instance_of[i]];
      next[i] = instance.first;
      // No branch, which would hang on what nobody can foresee.
      const bool is_likely = keys[i] <= instance.high_key;
      instance.first = is_likely ? static_cast<std::uint32_t>(i) : instance.first;
    }
  }

  LikelySamplesMemory& memory_;
  std::size_t count_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_LIKELY_SAMPLES_HPP
