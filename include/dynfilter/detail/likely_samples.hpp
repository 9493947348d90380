// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Which features of FP_object may be drawn for a sample of it.

#ifndef DYNFILTER_DETAIL_LIKELY_SAMPLES_HPP
#define DYNFILTER_DETAIL_LIKELY_SAMPLES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/index_selection.hpp"
#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/detail/sample_keys.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

/// An instance, and where what is known of its masked features stands.
struct MaskedInstance {
  std::uint64_t hash;      ///< of FeatureSampler
  std::uint64_t high_key;  ///< of so many features
  cv::Point corner;        ///< of the box
  std::uint32_t begin, end;
  std::uint32_t limit;   ///< the next instance's features begin there
  bool are_all_on_mask;  ///< no feature need be looked up on it
};

/// Memory that is kept between frames.
struct LikelySamplesMemory {
  std::vector<MaskedInstance> instances;
  // What is known of a masked feature stands at the same place in both.
  std::vector<cv::Point> pixels;
  std::vector<std::uint64_t> keys;
  std::vector<std::uint32_t> places;  ///< of the features that were asked for last
};

/// The features that were removed as in_mask and lie on the mask of their instance, not only within
/// a margin of it, and of those the ones with keys up to FeatureSampler::high_key: one pass over
/// the labels serves all instances.
class LikelySamples {
 public:
  LikelySamples(const FeatureSampler& sampler, const FilterInput& input,
                const FeatureLabels& labels, const FeaturePixels& pixels, InstructionSet best,
                LikelySamplesMemory& memory)
      : instances_(input.segmentation.instances), instruction_set_(best), memory_(memory) {
    const std::vector<InstanceStatistics>& statistics = labels.statistics().instances;
    memory.instances.clear();
    for (std::size_t k = 0; k < statistics.size(); ++k) {
      memory.instances.push_back({sampler.instance_hash(input.frame.id, k),
                                  sampler.high_key(statistics[k].masked), instances_[k].box.tl(), 0,
                                  0, 0, are_all_on_mask(labels.statistics(), k)});
    }
    reserve(labels.size());
    allot([&](std::size_t k) { return statistics[k].masked; });
    // Stages of the caller's may have written other statistics.
    if (!read_pixels(labels, pixels)) {
      count_masked(labels);
      allot([&](std::size_t k) { return memory.instances[k].end; });
      read_pixels(labels, pixels);
    }
    // In their order: what is written behind the last feature of one is overwritten by the next.
    for (const MaskedInstance& instance : memory.instances) {
      make_keys(instance.hash, instance.corner, &memory.pixels[instance.begin],
                instance.end - instance.begin, best, &memory.keys[instance.begin]);
    }
  }

  /// Features of an instance, by the places where more is known of them.
  struct Places {
    const std::uint32_t* first;
    const std::uint32_t* last;

    const std::uint32_t* begin() const { return first; }
    const std::uint32_t* end() const { return last; }
  };

  /// Those with low keys, until others are asked for. O(masked features of the instance).
  Places likely(std::size_t instance) const {
    return places_up_to(memory_.instances[instance].high_key, instance);
  }

  /// The same with all of them.
  Places all(std::size_t instance) const { return places_up_to(highest, instance); }

  /// Whether the likely ones are all.
  bool are_all(std::size_t instance) const {
    return memory_.instances[instance].high_key == highest;
  }

  /// By place.
  const cv::Point* pixels() const { return memory_.pixels.data(); }
  const std::uint64_t* keys() const { return memory_.keys.data(); }

 private:
  static constexpr std::uint64_t highest = std::numeric_limits<std::uint64_t>::max();

  void reserve(std::size_t features) {
    if (memory_.pixels.size() >= features + key_step) return;
    memory_.keys.resize(features + key_step);
    memory_.places.resize(features + block_size);
    memory_.pixels.resize(features + key_step);  // last: its size promises that of the others
  }

  /// Where none was restored, no other stage has removed any in the place of one that is counted.
  static bool are_all_on_mask(const FrameStatistics& statistics, std::size_t instance) {
    const InstanceStatistics& counts = statistics.instances[instance];
    return statistics.restored == 0 && counts.on_mask == counts.masked;
  }

  /// Room for the features of each instance, of all that there is.
  template <class Count>
  void allot(const Count& count_of) {
    std::size_t begin = 0;
    const std::size_t room = memory_.pixels.size() - key_step;
    for (std::size_t k = 0; k < memory_.instances.size(); ++k) {
      MaskedInstance& instance = memory_.instances[k];
      const std::size_t limit = begin + std::min<std::size_t>(count_of(k), room - begin);
      instance.begin = instance.end = static_cast<std::uint32_t>(begin);
      instance.limit = static_cast<std::uint32_t>(limit);
      begin = limit;
    }
  }

  /// Calls action(feature, instance) with each masked feature until it returns false. Returns
  /// whether it never did.
  template <class Action>
  static bool for_each_masked(const FeatureLabels& labels, const Action& action) {
    const std::vector<std::uint64_t>& removed = labels.removed_bits();
    for (std::size_t block = 0; block < removed.size(); ++block) {
      for (std::uint64_t bits = removed[block]; bits != 0; bits &= bits - 1) {
        const std::size_t i = block * block_size + lowest_bit(bits);
        const FeatureLabel& label = labels[i];
        if (label.reason != Reason::in_mask || label.instance < 0) continue;
        if (!action(i, static_cast<std::size_t>(label.instance))) return false;
      }
    }
    return true;
  }

  /// Whether there was room for all.
  bool read_pixels(const FeatureLabels& labels, const FeaturePixels& pixels) {
    MaskedInstance* const instances = memory_.instances.data();
    cv::Point* const masked_pixels = memory_.pixels.data();
    const cv::Point* const pixel_of = pixels.data();
    return for_each_masked(labels, [=](std::size_t i, std::size_t k) {
      const std::uint32_t place = instances[k].end;
      if (place == instances[k].limit) return false;
      masked_pixels[place] = pixel_of[i];
      instances[k].end = place + 1;
      return true;
    });
  }

  /// As `end` of the instances.
  void count_masked(const FeatureLabels& labels) {
    for (MaskedInstance& instance : memory_.instances) instance.end = 0;
    for_each_masked(labels, [&](std::size_t, std::size_t k) {
      ++memory_.instances[k].end;
      return true;
    });
  }

  Places places_up_to(std::uint64_t key, std::size_t k) const {
    const MaskedInstance& instance = memory_.instances[k];
    std::uint32_t* const places = memory_.places.data();
    const std::size_t count = list_low_keys(memory_.keys.data(), instance.begin, instance.end, key,
                                            instruction_set_, places);
    if (instance.are_all_on_mask) return {places, places + count};
    return {places, leave_on_mask(instances_[k], places, places + count)};
  }

  /// Leaves those that lie on the mask. Returns where they end.
  std::uint32_t* leave_on_mask(const Instance& instance, std::uint32_t* begin,
                               const std::uint32_t* end) const {
    const cv::Point* const pixel_of = memory_.pixels.data();
    std::uint32_t* left = begin;
    for (const std::uint32_t* block = begin; block < end; block += block_size) {
      const auto count = std::min(block_size, static_cast<std::size_t>(end - block));
      std::uint8_t on_mask[block_size];
      for (std::size_t i = 0; i < count; ++i) {
        on_mask[i] = instance.covers(pixel_of[block[i]]) ? 1 : 0;
      }
      const std::uint64_t bits = bits_of_bytes(on_mask) & bits_below(count);
      left += select_indices(block, bits, instruction_set_, left);
    }
    return left;
  }

  const std::vector<Instance>& instances_;
  InstructionSet instruction_set_;
  LikelySamplesMemory& memory_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_LIKELY_SAMPLES_HPP
