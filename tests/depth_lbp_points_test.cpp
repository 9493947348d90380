// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/depth_lbp_points.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "dynfilter/depth_lbp.hpp"
#include "support/oracle.hpp"

namespace dynfilter::testing {
namespace {

using detail::InstructionSet;

/// Some pixels, in an order of their own, and where they lie: where all have four depths about them
/// in each row, one step farther, or anywhere.
struct Points {
  Points(ByteSource& source, const cv::Size& image) {
    const cv::Point steps[] = {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    const cv::Point step = steps[source.between(0, 4)];
    const int beyond = source.chance(20) ? 4 : 0;
    for (int i = source.between(0, 80); i > 0; --i) {
      const int x = source.between(1 - beyond, image.width - 3 + beyond);
      const int y = source.between(1 - beyond, image.height - 2 + beyond);
      pixels.push_back(cv::Point(x, y) + step);
      indices.insert(indices.begin() + source.between(0, static_cast<int>(indices.size())),
                     static_cast<std::uint32_t>(pixels.size() - 1));
    }
    rectangle = cv::boundingRect(pixels);
  }

  std::vector<cv::Point> pixels;
  std::vector<std::uint32_t> indices;
  cv::Rect rectangle;
};

/// The image fills its memory to the last byte, for sanitizers to see what reads beyond it.
template <class Depth>
void expect_readings(const cv::Mat& image, const DepthLbpOptions& options, const Points& points,
                     InstructionSet set) {
  std::vector<Depth> memory(image.begin<Depth>(), image.end<Depth>());
  const cv::Mat depth(image.size(), image.type(), memory.data());
  const DepthLbp lbp(options);
  detail::DepthReadings readings;
  readings.reserve(points.indices.size());
  lbp.points_of<Depth>(depth).read(points.rectangle, points.pixels.data(), points.indices.data(),
                                   points.indices.data() + points.indices.size(), set, readings);
  for (std::size_t i = 0; i < points.indices.size(); ++i) {
    const cv::Point pixel = points.pixels[points.indices[i]];
    const bool is_inside = cv::Rect({0, 0}, depth.size()).contains(pixel);
    const std::uint32_t bits = is_inside ? detail::depth_bits(depth.at<Depth>(pixel)) : 0U;
    ASSERT_EQ(readings.depth_bits[i], bits) << pixel;
    const detail::PixelReading reading = {readings.depth_bits[i], readings.codes[i]};
    const auto expected = oracle_code(depth, WidePoint(pixel.x, pixel.y), options);
    ASSERT_EQ(detail::DepthLbpPoints<Depth>::has_code(reading), expected.has_value()) << pixel;
    if (expected) {
      ASSERT_EQ(reading.code, *expected) << pixel;
    }
  }
}

class DepthLbpPointsBySet : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(DepthLbpPointsBySet, ReadWhatTheOracleSaysInsideOfImagesAndOut) {
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    ByteSource source(seed);
    const cv::Size size(source.between(4, 40), source.between(3, 20));
    const bool is_float = source.chance(50);
    const cv::Mat depth = arbitrary_depth(source, size, is_float);
    const DepthLbpOptions options = arbitrary_options(source, size).compensator.paper.depth_lbp;
    const Points points(source, size);
    SCOPED_TRACE(seed);
    if (is_float) {
      expect_readings<float>(depth, options, points, GetParam());
    } else {
      expect_readings<std::uint16_t>(depth, options, points, GetParam());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, DepthLbpPointsBySet,
                         ::testing::ValuesIn(detail::supported_instruction_sets()));

}  // namespace
}  // namespace dynfilter::testing
