// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_SAMPLER_HPP
#define DYNFILTER_FEATURE_SAMPLER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {

/// A feature that may be sampled.
struct SampleCandidate {
  std::uint64_t key = 0;    ///< FeatureSampler::key of the feature
  cv::Point pixel;          ///< relative to the box
  std::size_t feature = 0;  ///< index of the feature
};

/// Draws "several feature points" of an object at random (paper section 3.2) without a generator
/// that has a state: every feature gets a 64-bit hash, and those with the smallest hashes are the
/// sample. So the sample is the same in any thread and for any order of the features, does not
/// change when the object moves as a whole with its box, and one frame can be replayed alone.
class FeatureSampler {
 public:
  /// `samples`: how many features to draw. Throws std::invalid_argument for 0.
  explicit FeatureSampler(std::size_t samples = 20, std::uint64_t seed = 0)
      : samples_(samples), seed_(seed) {
    if (samples == 0) detail::throw_misuse("FeatureSampler", "samples = 0", "at least 1");
  }

  /// The hash of (seed, frame id, instance index, pixel relative to the box). O(1).
  std::uint64_t key(std::uint64_t frame_id, std::size_t instance, cv::Point pixel) const {
    return key(instance_hash(frame_id, instance), pixel);
  }

  /// The same in two steps, for many features of one instance: what their keys have in common, and
  /// the rest.
  std::uint64_t instance_hash(std::uint64_t frame_id, std::size_t instance) const {
    return mix(mix(mix(seed_) ^ frame_id) ^ static_cast<std::uint64_t>(instance));
  }

  static std::uint64_t key(std::uint64_t instance_hash, cv::Point pixel) {
    const auto x = static_cast<std::uint32_t>(pixel.x);
    const auto y = static_cast<std::uint32_t>(pixel.y);
    return mix(instance_hash ^ (std::uint64_t{x} << 32U | y));
  }

  std::size_t samples() const { return samples_; }

  /// The highest key of about one and a half times the sample, of so many features: keys are hashes
  /// and lie evenly between 0 and 2^64. So most features need not be looked at to know that they
  /// are not drawn, provided that at least samples() others have keys up to this one.
  std::uint64_t high_key(std::size_t features) const {
    const double share = 1.5 * static_cast<double>(samples_) / static_cast<double>(features);
    return share < 1 ? static_cast<std::uint64_t>(share * 18446744073709551616.0)
                     : std::numeric_limits<std::uint64_t>::max();
  }

  /// Reduces the candidates to the sample, in no particular order: those with the smallest keys,
  /// all of them if there are fewer. Equal keys are told apart by their pixels (row, then column);
  /// features of the same pixel are interchangeable, since they read the same depth. O(candidates).
  void draw(std::vector<SampleCandidate>& candidates) const {
    const SampleCandidate* end = draw(candidates.data(), candidates.data() + candidates.size());
    candidates.resize(static_cast<std::size_t>(end - candidates.data()));
  }

  /// The same in an array: puts the sample at its beginning and returns where it ends.
  SampleCandidate* draw(SampleCandidate* begin, SampleCandidate* end) const {
    if (static_cast<std::size_t>(end - begin) <= samples_) return end;
    SampleCandidate* const sample_end = begin + samples_;
    std::nth_element(
        begin, sample_end, end, [](const SampleCandidate& a, const SampleCandidate& b) {
          return std::tie(a.key, a.pixel.y, a.pixel.x) < std::tie(b.key, b.pixel.y, b.pixel.x);
        });
    return sample_end;
  }

 private:
  /// One step of splitmix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators",
  /// OOPSLA 2014): a bijection whose output bits all depend on all input bits.
  static std::uint64_t mix(std::uint64_t state) {
    state += 0x9E3779B97F4A7C15U;
    state = (state ^ state >> 30U) * 0xBF58476D1CE4E5B9U;
    state = (state ^ state >> 27U) * 0x94D049BB133111EBU;
    return state ^ state >> 31U;
  }

  std::size_t samples_;
  std::uint64_t seed_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURE_SAMPLER_HPP
