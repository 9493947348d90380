// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/mask_distance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/filter_case.hpp"

namespace dynfilter::testing {
namespace {

/// Oracle: computes the distance to each pixel of the mask.
bool is_within(const Instance& instance, cv::Point pixel, double radius) {
  for (int y = 0; y < instance.mask.rows; ++y) {
    for (int x = 0; x < instance.mask.cols; ++x) {
      const double dx = double{1} * instance.mask_origin.x + x - pixel.x;
      const double dy = double{1} * instance.mask_origin.y + y - pixel.y;
      const bool is_near = dx * dx + dy * dy <= radius * radius || (dx == 0 && dy == 0);
      if (is_near && instance.mask.at<std::uint8_t>(y, x) != 0) return true;
    }
  }
  return false;
}

TEST(MaskDistance, MatchesBruteForce) {
  std::size_t within = 0, beyond = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const cv::Size image(source.between(1, 40), source.between(1, 40));
    const Instance instance = arbitrary_instance(source, image);
    const double radii[] = {0, 1, 1.25, 1.5, 2, 2.9, 5, 15.99, 16, 25, 1e6, -1};
    const double radius = radii[source.between(0, 11)];
    for (int i = 0; i < 20; ++i) {
      const cv::Point pixel(source.between(-30, 70), source.between(-30, 70));
      const bool expected = is_within(instance, pixel, std::max(radius, 0.0));
      ASSERT_EQ(detail::mask_within(instance, pixel, radius), expected) << "seed " << seed;
      ++(expected ? within : beyond);
    }
  }
  EXPECT_GT(within, 5000U);
  EXPECT_GT(beyond, 10000U);
}

TEST(MaskDistance, NanRadiusTestsThePixelItself) {
  Instance instance = Instance::from_box({0, 0, 3, 3});
  instance.mask = cv::Mat::zeros(3, 3, CV_8UC1);
  instance.mask.at<std::uint8_t>(1, 1) = 1;
  const double none = std::nan("");
  EXPECT_TRUE(detail::mask_within(instance, {1, 1}, none));
  EXPECT_FALSE(detail::mask_within(instance, {0, 1}, none));
}

}  // namespace
}  // namespace dynfilter::testing
