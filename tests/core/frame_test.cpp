// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/frame.hpp"

#include <gtest/gtest.h>

#include "support/oracle.hpp"

namespace dynfilter::testing {
namespace {

TEST(FrameView, DepthInMetresMatchesTheOracle) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    ByteSource source(seed);
    FrameView frame;
    const cv::Size size(source.between(1, 12), source.between(1, 12));
    frame.depth = arbitrary_depth(source, size, source.chance(50));
    frame.metres_per_unit = 0.25;
    for (int y = -1; y <= size.height; ++y) {
      for (int x = -1; x <= size.width; ++x) {
        const auto expected = oracle_depth(frame.depth, WidePoint(x, y));
        const auto got = frame.depth_m({x, y});
        ASSERT_EQ(got.has_value(), expected.has_value());
        if (expected) {
          ASSERT_EQ(*got, *expected * 0.25);
        }
      }
    }
  }
}

TEST(FrameView, FloatDepthIsInMetresByDefault) {
  FrameView frame;
  frame.depth = cv::Mat(1, 1, CV_32FC1, cv::Scalar(2.0));
  EXPECT_EQ(frame.depth_m({0, 0}), 2.0);
  frame.metres_per_unit = 0.001;
  EXPECT_EQ(frame.depth_m({0, 0}), 0.002);
}

TEST(FrameView, HasNoDepthWithoutADepthImage) { EXPECT_FALSE(FrameView().depth_m({0, 0})); }

}  // namespace
}  // namespace dynfilter::testing
