// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/feature_sampler.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace dynfilter {
namespace {

/// Features in a row of pixels, with the keys of one frame.
std::vector<SampleCandidate> candidates_of(const FeatureSampler& sampler, std::uint64_t frame,
                                           std::size_t count) {
  std::vector<SampleCandidate> candidates;
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Point pixel(static_cast<int>(i), 3);
    candidates.push_back({sampler.key(frame, 1, pixel), pixel, i});
  }
  return candidates;
}

std::vector<std::size_t> drawn(const FeatureSampler& sampler,
                               std::vector<SampleCandidate> candidates) {
  sampler.draw(candidates);
  std::vector<std::size_t> features;
  for (const SampleCandidate& candidate : candidates) features.push_back(candidate.feature);
  std::sort(features.begin(), features.end());
  return features;
}

TEST(FeatureSampler, KeysArePinned) {
  EXPECT_EQ(FeatureSampler(20, 0).key(0, 0, {0, 0}), 0x2130748AAAC80268U);
  EXPECT_EQ(FeatureSampler(20, 42).key(7, 2, {13, 200}), 0x76DA5E46064E15E7U);
  EXPECT_EQ(FeatureSampler(20, 42).key(7, 2, {-1, -200}), 0xF8C17E23B794F586U);
  const std::uint64_t instance_key = FeatureSampler(20, 42).instance_key(7, 2);
  EXPECT_EQ(FeatureSampler::key(instance_key, {13, 200}), 0x76DA5E46064E15E7U);
}

TEST(FeatureSampler, SampleIsPinned) {
  const FeatureSampler sampler(8, 5);
  EXPECT_EQ(drawn(sampler, candidates_of(sampler, 11, 60)),
            (std::vector<std::size_t>{1, 8, 18, 37, 40, 46, 48, 51}));
}

/// Over many frames every feature is drawn equally often, and so is every pair of neighbours. Each
/// cell adds (count - expected)^2 / variance, which has mean 1. The statistic of n cells is thus
/// about chi-square with n degrees of freedom: mean n, standard deviation sqrt(2 n). The seed is
/// fixed, so the test does not fail by chance.
TEST(FeatureSampler, IsUnbiased) {
  constexpr std::size_t features = 200, samples = 20;
  constexpr double frames = 5000;
  const FeatureSampler sampler(samples, 2024);
  std::vector<double> hits(features), pairs(features);
  for (std::uint64_t frame = 0; frame < static_cast<std::uint64_t>(frames); ++frame) {
    const std::vector<std::size_t> sample = drawn(sampler, candidates_of(sampler, frame, features));
    for (std::size_t i = 0; i < sample.size(); ++i) {
      hits[sample[i]] += 1;
      if (i > 0 && sample[i] == sample[i - 1] + 1) pairs[sample[i]] += 1;
    }
  }
  const auto require_uniform = [&](const std::vector<double>& counts, std::size_t first,
                                   double probability) {
    const double expected = frames * probability;
    const double variance = expected * (1 - probability);
    double statistic = 0;
    double cells = 0;
    for (std::size_t i = first; i < counts.size(); ++i, ++cells) {
      statistic += (counts[i] - expected) * (counts[i] - expected) / variance;
    }
    EXPECT_NEAR(statistic, cells, 4 * std::sqrt(2 * cells));
  };
  const double share = double{samples} / features;
  require_uniform(hits, 0, share);
  require_uniform(pairs, 1, share * (samples - 1.0) / (features - 1.0));
}

/// Compares with sorting. Callers may use their own keys, so they are spread like hashes, all
/// large, all small, or mostly equal.
TEST(FeatureSampler, DrawsTheSmallestKeysOfAnyDistribution) {
  for (std::uint64_t frame = 0; frame < 200; ++frame) {
    for (const std::size_t count : {0U, 1U, 19U, 20U, 21U, 40U, 41U, 79U, 300U}) {
      const FeatureSampler sampler(20, frame);
      std::vector<SampleCandidate> candidates = candidates_of(sampler, frame, count);
      for (SampleCandidate& candidate : candidates) {
        if (frame % 4 == 1) candidate.key |= 0xFFFF000000000000U;
        if (frame % 4 == 2) candidate.key >>= 16U;
        if (frame % 4 == 3) candidate.key %= 3;
      }
      std::vector<SampleCandidate> sorted = candidates;
      std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        return a.key != b.key ? a.key < b.key : a.pixel.x < b.pixel.x;
      });
      std::vector<std::size_t> expected;
      for (std::size_t i = 0; i < std::min<std::size_t>(20, count); ++i) {
        expected.push_back(sorted[i].feature);
      }
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(drawn(sampler, candidates), expected) << "frame " << frame << ", " << count;
    }
  }
}

}  // namespace
}  // namespace dynfilter
