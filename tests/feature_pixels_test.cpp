// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/feature_pixels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "dynfilter/labels.hpp"
#include "support/byte_source.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

using Features = std::vector<std::size_t>;

/// In 64 bits and one by one; what is no position is nowhere.
bool is_inside(cv::Point2f position, const cv::Rect& rectangle) {
  const double x = std::floor(double{position.x} + 0.5) - rectangle.x;
  const double y = std::floor(double{position.y} + 0.5) - rectangle.y;
  return std::abs(position.x) < 2147483648.0F && std::abs(position.y) < 2147483648.0F && x >= 0 &&
         y >= 0 && x < rectangle.width && y < rectangle.height;
}

Features plainly_inside(const std::vector<cv::Point2f>& points, const cv::Rect& rectangle,
                        const std::vector<std::uint64_t>& without) {
  Features inside;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_left_out = (without[i / 64] >> i % 64 & 1U) != 0;
    if (!is_left_out && is_inside(points[i], rectangle)) inside.push_back(i);
  }
  return inside;
}

Features inside_of(const FeaturePixels& pixels, const cv::Rect& rectangle,
                   const std::vector<std::uint64_t>& without) {
  std::vector<std::uint32_t> memory;
  const FeatureList list = pixels.inside(rectangle, without, memory);
  EXPECT_EQ(list.features(), pixels.size());
  Features inside(list.begin(), list.end());
  std::sort(inside.begin(), inside.end());
  return inside;
}

/// Of every second feature or so, or of none.
std::vector<std::uint64_t> arbitrary_bits(ByteSource& source, std::size_t features) {
  std::vector<std::uint64_t> bits(detail::blocks_for(features));
  if (source.chance(40)) return bits;
  for (std::uint64_t& word : bits) {
    for (int k = 0; k < 64; ++k) word = word << 1U | (source.chance(50) ? 1U : 0U);
  }
  return bits;
}

/// On pixels, on their edges, outside of images, at the ends of 16 bits, and no numbers at all.
float arbitrary_coordinate(ByteSource& source, bool hostile) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float odd[] = {NAN,      infinity,  -infinity, 3e9F,      -3e9F,          2147483520.0F,
                       32766.5F, -32766.5F, 32767.0F,  -32767.0F, -2147483648.0F, 40000.0F};
  if (hostile && source.chance(4)) return odd[source.between(0, 11)];
  return static_cast<float>(source.between(-40, 640 * 4)) / 4;
}

std::vector<cv::Point2f> arbitrary_points(ByteSource& source, std::size_t count) {
  const bool hostile = source.chance(60);
  std::vector<cv::Point2f> points(count);
  for (cv::Point2f& point : points) {
    point = {arbitrary_coordinate(source, hostile), arbitrary_coordinate(source, hostile)};
  }
  return points;
}

cv::Rect arbitrary_rectangle(ByteSource& source) {
  constexpr int least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  const int odd_first[] = {least, least + 1, -40000, -32768, -32767, -32766, 32000, 40000, most};
  const int odd_length[] = {0, 1, 32767, 32768, 65534, 70000, most};
  const auto first = [&] {
    return source.chance(10) ? odd_first[source.between(0, 8)] : source.between(-30, 640);
  };
  const auto length = [&] {
    return source.chance(10) ? odd_length[source.between(0, 6)] : source.between(0, 400);
  };
  const int x = first(), y = first(), width = length();
  return {x, y, width, length()};
}

class FeaturePixelsBySet : public ::testing::TestWithParam<detail::InstructionSet> {};

/// The same object for all, so that each reading has to forget the one before.
TEST_P(FeaturePixelsBySet, FindsInARectangleWhatAPlainLoopFinds) {
  FeaturePixels pixels(GetParam());
  std::size_t found = 0;
  const std::size_t counts[] = {0, 1, 2, 63, 64, 65, 127, 128, 129, 300, 1000};
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const std::vector<cv::Point2f> points = arbitrary_points(source, counts[source.between(0, 10)]);
    const std::size_t rectangles = source.chance(50) ? 100 : 0;  // sorted, or as they are
    pixels.read(points, rectangles);
    ASSERT_EQ(pixels.size(), points.size());
    const std::vector<std::uint64_t> without = arbitrary_bits(source, points.size());
    for (int round = 0; round < 10; ++round) {
      const cv::Rect rectangle = arbitrary_rectangle(source);
      const Features expected = plainly_inside(points, rectangle, without);
      ASSERT_EQ(inside_of(pixels, rectangle, without), expected)
          << "seed " << seed << ": " << rectangle << ", sorted for " << rectangles;
      found += expected.size();
    }
  }
  EXPECT_GT(found, 100000U);
}

TEST_P(FeaturePixelsBySet, AreThoseOfTheView) {
  FeaturePixels pixels(GetParam());
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    ByteSource source(seed);
    const auto points = arbitrary_points(source, static_cast<std::size_t>(source.between(0, 200)));
    std::vector<cv::KeyPoint> keypoints;
    for (const cv::Point2f point : points) keypoints.emplace_back(point, 7.0F);
    pixels.read(keypoints, seed % 2 * 50);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(pixels[i], nearest_pixel(points[i])) << "seed " << seed << ", feature " << i;
    }
  }
}

/// The float before each half, the half, and the one after it, of either sign.
TEST_P(FeaturePixelsBySet, RoundHalvesUpAndNothingElse) {
  std::vector<cv::Point2f> points;
  for (int pixel = -130; pixel < 130; ++pixel) {
    const float half = static_cast<float>(pixel) + 0.5F;
    for (const float x : {std::nextafter(half, -1e9F), half, std::nextafter(half, 1e9F)}) {
      points.emplace_back(x, static_cast<float>(pixel));
    }
  }
  FeaturePixels pixels(GetParam());
  pixels.read(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double exact = std::floor(double{points[i].x} + 0.5);
    ASSERT_EQ(pixels[i], cv::Point(static_cast<int>(exact), static_cast<int>(points[i].y))) << i;
  }
}

/// Floats of all sizes and of either sign, those that no int can hold, infinities and NaN.
TEST_P(FeaturePixelsBySet, RoundFloatsOfAnySizeAsOneByOne) {
  std::vector<cv::Point2f> points;
  for (std::uint32_t bits = 0; bits < 0x80000000U; bits += 16384) {
    float value = 0;
    std::memcpy(&value, &bits, sizeof value);
    points.emplace_back(value, -value);
  }
  FeaturePixels pixels(GetParam());
  pixels.read(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(pixels[i], nearest_pixel(points[i])) << points[i];
  }
}

TEST_P(FeaturePixelsBySet, KnowWhereAllOfThemLie) {
  std::size_t unknown = 0;
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    ByteSource source(seed);
    const auto points = arbitrary_points(source, static_cast<std::size_t>(source.between(0, 200)));
    FeaturePixels pixels(GetParam());
    pixels.read(points);
    bool are_near = !points.empty();
    std::vector<cv::Point> all;
    for (std::size_t i = 0; i < points.size(); ++i) {
      all.push_back(pixels[i]);
      are_near &= all[i].x > -32768 && all[i].x < 32767 && all[i].y > -32768 && all[i].y < 32767;
    }
    unknown += are_near ? 0 : 1;
    ASSERT_EQ(pixels.bounds(), are_near ? cv::boundingRect(all) : cv::Rect()) << "seed " << seed;
  }
  EXPECT_GT(unknown, 50U);
  EXPECT_LT(unknown, 550U);
}

INSTANTIATE_TEST_SUITE_P(All, FeaturePixelsBySet,
                         ::testing::ValuesIn(detail::supported_instruction_sets()));

TEST(FeaturePixels, MayBeNoneInAnyMemory) {
  FeaturePixels pixels;
  pixels.read({}, 100);
  EXPECT_EQ(pixels.size(), 0U);
  EXPECT_TRUE(inside_of(pixels, {0, 0, 640, 480}, {}).empty());
}

TEST(FeaturePixels, RefuseTooFewBits) {
  FeaturePixels pixels;
  pixels.read(std::vector<cv::Point2f>(65));
  std::vector<std::uint32_t> memory;
  expect_error<std::invalid_argument>(
      [&] {
        pixels.inside({0, 0, 9, 9}, {0}, memory);
      },
      "1 words of bits");
}

TEST(FeaturePixels, ListAllButThoseWithABit) {
  FeaturePixels pixels;
  std::vector<std::uint32_t> memory;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    ByteSource source(seed);
    const auto points = arbitrary_points(source, static_cast<std::size_t>(source.between(0, 200)));
    pixels.read(points);
    const std::vector<std::uint64_t> without = arbitrary_bits(source, points.size());
    const FeatureList list = pixels.all_but(without, memory);
    Features expected;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if ((without[i / 64] >> i % 64 & 1U) == 0) expected.push_back(i);
    }
    ASSERT_EQ(Features(list.begin(), list.end()), expected) << "seed " << seed;
  }
}

TEST(FeaturePixels, ListsOfAnotherFrameRemoveNothing) {
  FeaturePixels pixels;
  pixels.read(std::vector<cv::Point2f>(3));
  std::vector<std::uint32_t> memory;
  const FeatureList list = pixels.all_but({0}, memory);
  FeatureLabels labels(2, {});
  expect_error<std::invalid_argument>([&] { labels.remove_all(list, -1, Reason::in_mask, 1.0F); },
                                      "feature 2");
  EXPECT_EQ(labels.statistics().removed(), 0U);
}

TEST(FeaturePixels, KnowWhoseTheyAre) {
  const std::vector<cv::Point2f> points(9), others(9);
  FeaturePixels pixels;
  pixels.read(points);
  EXPECT_TRUE(pixels.are_of(points));
  EXPECT_FALSE(pixels.are_of(others));
  EXPECT_FALSE(pixels.are_of(FeaturesView(points.data(), 8)));
}

}  // namespace
}  // namespace dynfilter::testing
