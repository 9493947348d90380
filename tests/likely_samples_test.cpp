// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/likely_samples.hpp"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <vector>

#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using detail::InstructionSet;
using detail::LikelySamples;
using detail::LikelySamplesMemory;

class SampleKeys : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(SampleKeys, OfABlockAreThoseOfEachFeature) {
  ByteSource source(1);
  for (int round = 0; round < 100; ++round) {
    std::array<cv::Point, detail::block_size> pixels;
    std::array<std::uint64_t, detail::block_size> hashes;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] = {static_cast<int>(source.word()), static_cast<int>(source.word())};
      hashes[i] = std::uint64_t{source.word()} << 32U | source.word();
    }
    std::array<std::uint64_t, detail::block_size> keys = hashes;
    detail::make_keys(pixels.data(), GetParam(), keys.data());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      ASSERT_EQ(keys[i], FeatureSampler::key(hashes[i], pixels[i])) << pixels[i];
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, SampleKeys,
                         ::testing::ValuesIn(detail::supported_instruction_sets()));

/// Features with labels of all sorts.
struct LabelledFrame {
  explicit LabelledFrame(ByteSource& source) {
    frame.id = source.byte();
    segmentation.image_size = {300, 300};
    const int instances = source.between(0, 5);
    for (int k = 0; k < instances; ++k) {
      const cv::Point corner(source.between(-20, 200), source.between(-20, 200));
      segmentation.instances.push_back(Instance::from_box({corner, cv::Size(90, 90)}));
    }
    positions.resize(static_cast<std::size_t>(source.between(0, 400)));
    for (cv::Point2f& position : positions) {
      position = {static_cast<float>(source.byte()), static_cast<float>(source.byte())};
    }
    labels.reset(positions.size(), segmentation);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      if (source.chance(30)) continue;
      const Reason reason = source.chance(80) ? Reason::in_mask : Reason::custom;
      labels.remove(i, source.between(-1, instances - 1), reason, 1.0F);
      if (source.chance(5)) labels.restore(i);
    }
    pixels.read(positions);
  }

  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::Point2f> positions;
  FeatureLabels labels;
  FeaturePixels pixels;
};

using KeyOfFeature = std::map<std::size_t, std::uint64_t>;

/// The masked features of an instance with their keys, one by one.
KeyOfFeature expected_keys(const LabelledFrame& given, const FeatureSampler& sampler,
                           std::size_t instance) {
  KeyOfFeature keys;
  for (std::size_t i = 0; i < given.labels.size(); ++i) {
    const FeatureLabel& label = given.labels[i];
    if (label.reason != Reason::in_mask || label.instance != static_cast<int>(instance)) continue;
    const cv::Point in_box = given.pixels[i] - given.segmentation.instances[instance].box.tl();
    keys[i] = sampler.key(given.frame.id, instance, in_box);
  }
  return keys;
}

TEST(LikelySamples, AreTheMaskedFeaturesOfEachInstanceAndThoseWithLowKeys) {
  LikelySamplesMemory memory;
  std::size_t instances_with_unlikely = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const LabelledFrame given(source);
    const FeatureSampler sampler(10, seed);
    const FilterInput input{given.frame, given.segmentation, given.positions};
    const LikelySamples samples(sampler, input, given.labels, given.pixels,
                                detail::best_instruction_set(), memory);
    for (std::size_t k = 0; k < given.segmentation.instances.size(); ++k) {
      const KeyOfFeature expected = expected_keys(given, sampler, k);
      KeyOfFeature likely_expected, all, likely;
      const std::uint64_t high_key = sampler.high_key(expected.size());
      for (const auto& [feature, key] : expected) {
        if (key <= high_key) likely_expected[feature] = key;
      }
      samples.for_each(k, [&](const SampleCandidate& c) { all[c.feature] = c.key; });
      samples.for_each_likely(k, [&](const SampleCandidate& c) { likely[c.feature] = c.key; });
      ASSERT_EQ(all, expected) << "seed " << seed;
      ASSERT_EQ(likely, likely_expected) << "seed " << seed;
      if (samples.are_all(k)) {
        ASSERT_EQ(likely, all) << "seed " << seed;
      }
      instances_with_unlikely += likely.size() < all.size() ? 1 : 0;
    }
  }
  EXPECT_GT(instances_with_unlikely, 100U);
}

}  // namespace
}  // namespace dynfilter::testing
