// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/dense_depth_lbp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "support/oracle.hpp"

namespace dynfilter::testing {
namespace {

/// Paper, Figure 2: neighbours clockwise from the top-left one; bit 1 if greater than the centre.
TEST(DepthLbp, MatchesThePapersExample) {
  // 6 5 2      0 0 0
  // 7 6 1  ->  1 . 0
  // 9 8 7      1 1 1
  const cv::Mat_<std::uint16_t> grey = (cv::Mat_<std::uint16_t>(3, 3) << 6, 5, 2, 7, 6, 1, 9, 8, 7);
  // Bottom-right 7 sets bit 4, bottom 8 bit 5, bottom-left 9 bit 6, left 7 bit 7; an equal 6 sets
  // none.
  EXPECT_EQ(DepthLbp().code(grey, {1, 1}), 16 + 32 + 64 + 128);

  cv::Mat metres;
  grey.convertTo(metres, CV_32FC1, 0.1);
  EXPECT_EQ(DepthLbp().code(metres, {1, 1}), 16 + 32 + 64 + 128);
}

TEST(DepthLbp, EachNeighbourSetsItsOwnBit) {
  const cv::Point clockwise[] = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
  for (std::size_t k = 0; k < 8; ++k) {
    cv::Mat depth(3, 3, CV_16UC1, cv::Scalar(500));
    depth.at<std::uint16_t>(clockwise[k]) = 501;
    EXPECT_EQ(DepthLbp().code(depth, {1, 1}), 1 << k);
  }
}

TEST(DepthLbp, MissingNeighbourCountsAsNearer) {
  cv::Mat depth(3, 3, CV_16UC1, cv::Scalar(65535));
  depth.at<std::uint16_t>(0, 0) = 0;
  EXPECT_EQ(DepthLbp().code(depth, {1, 1}), 0);
}

TEST(DepthLbp, AllCallsMatchTheOracleOnHostileDepths) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const int width = source.between(1, 40);
    const cv::Size size(width, source.between(1, 12));
    const cv::Mat depth = arbitrary_depth(source, size, source.chance(50));
    const DepthLbp lbp;
    const cv::Mat dense = dense_depth_lbp(depth);
    ASSERT_EQ(dense.size(), size);
    ASSERT_EQ(dense.type(), CV_8UC1);
    std::vector<cv::Point2f> points;
    for (int y = -1; y <= size.height; ++y) {
      for (int x = -1; x <= size.width; ++x) {
        points.emplace_back(static_cast<float>(x), static_cast<float>(y));
      }
    }
    std::vector<std::optional<std::uint8_t>> codes;
    lbp.codes(depth, points, codes);
    ASSERT_EQ(codes.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const cv::Point pixel = nearest_pixel(points[i]);
      const auto expected = oracle_code(depth, WidePoint(pixel.x, pixel.y));
      ASSERT_EQ(lbp.code(depth, pixel), expected) << "seed " << seed << " at " << pixel;
      ASSERT_EQ(codes[i], expected) << "seed " << seed << " at " << pixel;
      if (!cv::Rect({0, 0}, size).contains(pixel)) continue;
      ASSERT_EQ(dense.at<std::uint8_t>(pixel), expected.value_or(0)) << "seed " << seed << pixel;
    }
  }
}

/// Image that fills its memory to the last byte, so that sanitizers see reads beyond it.
template <class Depth>
void read_all_pixels_of(const cv::Size& size) {
  std::vector<Depth> depths(static_cast<std::size_t>(size.area()), Depth{1000});
  const cv::Mat depth(size, cv::DataType<Depth>::type, depths.data());
  const cv::Mat codes = dense_depth_lbp(depth);
  std::vector<cv::Point2f> pixels;
  for (int y = -1; y <= size.height; ++y) {
    for (int x = -1; x <= size.width; ++x) {
      pixels.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
  std::vector<std::optional<std::uint8_t>> at_points;
  DepthLbp().codes(depth, pixels, at_points);
  const auto inner = std::max(size.width - 2, 0) * std::max(size.height - 2, 0);
  EXPECT_EQ(std::count_if(at_points.begin(), at_points.end(),
                          [](const auto& code) { return code.has_value(); }),
            inner);
  EXPECT_EQ(cv::countNonZero(codes), 0);
}

TEST(DepthLbp, ReadsNothingBeyondTheImage) {
  for (int width = 1; width < 80; ++width) {
    for (int height = 1; height < 6; ++height) {
      read_all_pixels_of<std::uint16_t>({width, height});
      read_all_pixels_of<float>({width, height});
    }
  }
}

TEST(DepthLbp, AnEmptyDepthImageHasNoCodes) {
  EXPECT_FALSE(DepthLbp().code(cv::Mat(), {0, 0}));
  EXPECT_TRUE(dense_depth_lbp(cv::Mat()).empty());
}

}  // namespace
}  // namespace dynfilter::testing
