// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mixed_bits.hpp"

namespace dynfilter {

/// Feature that may be sampled.
struct SampleCandidate {
  cv::Point pixel;          ///< pixel relative to the box
  std::size_t feature = 0;  ///< index of the feature
  double depth_m = 0;       ///< its depth, metres
  std::uint64_t key = 0;    ///< FeatureSampler::key of the feature, which draw writes
};

/// Draws "several feature points" of an object at random (paper section 3.2) without a stateful
/// generator: every feature gets a 64-bit hash, and the features with the smallest hashes are the
/// sample. So the sample is the same in any thread and for any order of the features, it does not
/// change when the object moves together with its box, and any frame can be replayed alone.
class FeatureSampler {
 public:
  /// Takes the number of features to draw and the seed. Throws std::invalid_argument for 0 samples.
  explicit FeatureSampler(std::size_t samples = 20, std::uint64_t seed = 0)
      : samples_(samples), seed_(seed) {
    if (samples == 0) detail::throw_misuse("FeatureSampler", "samples = 0", "at least 1");
  }

  /// Returns the hash of (seed, frame id, instance index, pixel relative to the box). O(1).
  std::uint64_t key(std::uint64_t frame_id, std::size_t instance, cv::Point pixel) const {
    const std::uint64_t frame_key = detail::mixed_bits(detail::mixed_bits(seed_) ^ frame_id);
    const auto x = static_cast<std::uint32_t>(pixel.x), y = static_cast<std::uint32_t>(pixel.y);
    return detail::mixed_bits(detail::mixed_bits(frame_key ^ instance) ^
                              (std::uint64_t{x} << 32U | y));
  }

  /// Number of features to draw.
  std::size_t samples() const { return samples_; }

  /// Reduces the candidates of an instance to its sample: those with the smallest keys, or all if
  /// there are fewer, in no particular order. Equal keys are ordered by their pixels (row, then
  /// column), then by their depths; features that agree in all are interchangeable. O(candidates).
  void draw(std::uint64_t frame_id, std::size_t instance,
            std::vector<SampleCandidate>& candidates) const {
    if (candidates.size() <= samples_) return;
    for (SampleCandidate& one : candidates) one.key = key(frame_id, instance, one.pixel);
    const auto sample_end = candidates.begin() + static_cast<std::ptrdiff_t>(samples_);
    std::nth_element(candidates.begin(), sample_end, candidates.end(),
                     [](const SampleCandidate& a, const SampleCandidate& b) {
                       return std::tie(a.key, a.pixel.y, a.pixel.x, a.depth_m) <
                              std::tie(b.key, b.pixel.y, b.pixel.x, b.depth_m);
                     });
    candidates.erase(sample_end, candidates.end());
  }

 private:
  std::size_t samples_;
  std::uint64_t seed_;
};

}  // namespace dynfilter
