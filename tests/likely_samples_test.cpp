// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/likely_samples.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using detail::InstructionSet;
using detail::LikelySamples;
using detail::LikelySamplesMemory;

class SampleKeys : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(SampleKeys, OfManyAreThoseOfEachFeature) {
  for (std::size_t count = 0; count < 100; ++count) {
    ByteSource source(count);
    const auto number = [&] { return static_cast<int>(source.word()); };
    std::vector<cv::Point> pixels(count + detail::key_step);
    for (cv::Point& pixel : pixels) pixel = {number(), number()};
    const std::uint64_t hash = std::uint64_t{source.word()} << 32U | source.word();
    const cv::Point corner(number(), number());
    std::vector<std::uint64_t> keys(pixels.size());
    detail::make_keys(hash, corner, pixels.data(), count, GetParam(), keys.data());
    for (std::size_t i = 0; i < count; ++i) {
      const cv::Point in_box = detail::wrapping_difference(pixels[i], corner);
      ASSERT_EQ(keys[i], FeatureSampler::key(hash, in_box)) << pixels[i];
    }
  }
}

TEST_P(SampleKeys, ThatAreLowAreListedInOrder) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const std::uint32_t begin = source.byte() % 20U, end = begin + source.byte() % 100U;
    std::vector<std::uint64_t> keys(end + 8);
    for (std::uint64_t& key : keys) key = std::uint64_t{source.byte()} << 56U;
    const std::uint64_t highest = source.chance(10) ? ~std::uint64_t{0} : keys[begin];
    std::vector<std::uint32_t> expected, low(end - begin + 8);
    for (std::uint32_t i = begin; i < end; ++i) {
      if (keys[i] <= highest) expected.push_back(i);
    }
    low.resize(detail::list_low_keys(keys.data(), begin, end, highest, GetParam(), low.data()));
    ASSERT_EQ(low, expected) << "seed " << seed;
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
      const cv::Rect box(corner, cv::Size(90, 90));
      cv::Mat mask(box.size(), CV_8UC1, cv::Scalar(255));
      mask.colRange(0, source.between(0, 40)) = 0;
      segmentation.instances.push_back(Instance::from_box_mask(mask, box));
    }
    positions.resize(static_cast<std::size_t>(source.between(0, 400)));
    for (cv::Point2f& position : positions) {
      position = {static_cast<float>(source.byte()), static_cast<float>(source.byte())};
    }
    pixels.read(positions);
    labels.reset(positions.size(), segmentation);
    const int beside = source.chance(50) ? 0 : 30, restored = source.chance(50) ? 0 : 5;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      if (source.chance(30)) continue;
      const int k = source.between(-1, instances - 1);
      const bool is_on_mask = k >= 0 && instance(k).covers(pixels[i]);
      const bool is_masked = is_on_mask || source.chance(beside);
      labels.remove(i, k, is_masked ? Reason::in_mask : Reason::custom, 1.0F);
      if (is_on_mask) ++statistics(k).on_mask;
      if (source.chance(restored)) labels.restore(i);
    }
    // A stage of the caller's may write anything.
    if (instances > 0 && source.chance(20)) statistics(0).masked = source.byte();
  }

  const Instance& instance(int k) const {
    return segmentation.instances[static_cast<std::size_t>(k)];
  }
  InstanceStatistics& statistics(int k) {
    return labels.statistics().instances[static_cast<std::size_t>(k)];
  }

  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::Point2f> positions;
  FeatureLabels labels;
  FeaturePixels pixels;
};

/// Where a feature is, and its key.
using Known = std::tuple<int, int, std::uint64_t>;

/// The features of an instance that are masked and on its mask, one by one.
std::multiset<Known> expected_samples(const LabelledFrame& given, const FeatureSampler& sampler,
                                      std::size_t k, std::uint64_t highest) {
  std::multiset<Known> samples;
  const Instance& instance = given.segmentation.instances[k];
  for (std::size_t i = 0; i < given.labels.size(); ++i) {
    const FeatureLabel& label = given.labels[i];
    if (label.reason != Reason::in_mask || label.instance != static_cast<int>(k)) continue;
    const cv::Point pixel = given.pixels[i];
    const std::uint64_t key = sampler.key(given.frame.id, k, pixel - instance.box.tl());
    if (instance.covers(pixel) && key <= highest) samples.emplace(pixel.x, pixel.y, key);
  }
  return samples;
}

std::multiset<Known> known_at(const LikelySamples& samples, const LikelySamples::Places& places) {
  std::multiset<Known> known;
  for (const std::uint32_t place : places) {
    const cv::Point pixel = samples.pixels()[place];
    known.emplace(pixel.x, pixel.y, samples.keys()[place]);
  }
  return known;
}

class LikelySamplesBySet : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(LikelySamplesBySet, AreTheMaskedFeaturesOfEachInstanceAndThoseWithLowKeys) {
  constexpr std::uint64_t highest = ~std::uint64_t{0};
  LikelySamplesMemory memory;
  std::size_t instances_with_unlikely = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    ByteSource source(seed);
    const LabelledFrame given(source);
    const FeatureSampler sampler(10, seed);
    const FilterInput input{given.frame, given.segmentation, given.positions};
    const LikelySamples samples(sampler, input, given.labels, given.pixels, GetParam(), memory);
    for (std::size_t k = 0; k < given.segmentation.instances.size(); ++k) {
      const std::size_t masked = given.labels.statistics().instances[k].masked;
      const auto all = known_at(samples, samples.all(k));
      const auto likely = known_at(samples, samples.likely(k));
      ASSERT_EQ(all, expected_samples(given, sampler, k, highest)) << "seed " << seed;
      ASSERT_EQ(likely, expected_samples(given, sampler, k, sampler.high_key(masked)))
          << "seed " << seed;
      if (samples.are_all(k)) {
        ASSERT_EQ(likely, all) << "seed " << seed;
      }
      instances_with_unlikely += likely.size() < all.size() ? 1 : 0;
    }
  }
  EXPECT_GT(instances_with_unlikely, 100U);
}

INSTANTIATE_TEST_SUITE_P(All, LikelySamplesBySet,
                         ::testing::ValuesIn(detail::supported_instruction_sets()));

}  // namespace
}  // namespace dynfilter::testing
