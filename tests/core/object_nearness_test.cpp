// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/object_nearness.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/depth_oracle.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

ObjectDepth object_at(double lower_m, double upper_m) {
  ObjectDepth object;
  object.mask_range_m = {lower_m, upper_m};
  return object;
}

FrameView frame_of(float depth_m) {
  FrameView frame;
  frame.depth = cv::Mat(100, 640, CV_32FC1, cv::Scalar(depth_m));
  return frame;
}

const cv::Point centre(320, 50);

double nearness(const FrameView& frame, cv::Point pixel, double reach_px = 10) {
  return object_nearness(frame, pixel, object_at(1.1, 1.9), reach_px);
}

TEST(ObjectNearness, MatchesTheOracleOnHostileDepth) {
  std::size_t some = 0;
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    ByteSource source(seed);
    const int width = source.chance(20) ? source.between(600, 700) : source.between(1, 40);
    const cv::Size size(width, source.between(1, 12));
    FrameView frame;
    const bool floating = source.chance(50);
    frame.depth = arbitrary_depth(source, size, floating);
    frame.metres_per_unit = floating ? 0 : 1.0 / 5000;
    ObjectDepth object = object_at(source.between(-2, 10) / 10.0, source.between(0, 20) / 10.0);
    if (source.chance(50)) object.box_range_m = {1.9, 2.3};
    OracleObject expected;
    expected.ranges = {object.mask_range_m, object.box_range_m};
    const double reach = std::min(1000.0, (source.between(0, 6) + 0.2) * 640 / width);
    const cv::Point pixel(source.between(0, size.width - 1), source.between(0, size.height - 1));
    Instance instance;
    instance.mask_origin = {source.between(-5, width), source.between(-3, 8)};
    instance.mask = arbitrary_mask(source, {source.between(1, 8), source.between(1, 8)});
    const Instance* const mask = source.chance(50) ? &instance : nullptr;
    const double want = oracle_nearness(frame, WidePoint(pixel), expected, reach, mask);
    ASSERT_NEAR(object_nearness(frame, pixel, object, reach, mask), want, 1e-12) << "seed " << seed;
    some += want > 0 ? 1 : 0;
  }
  EXPECT_GT(some, 1500U);
}

TEST(ObjectNearness, RefusesBadArgumentsByName) {
  const FrameView frame = frame_of(1.5F);
  using Error = std::invalid_argument;
  for (const cv::Point outside : {cv::Point(-1, 5), cv::Point(5, -1), cv::Point(640, 5),
                                  cv::Point(5, 100), cv::Point(1 << 30, 1 << 30)}) {
    expect_error<Error>([&] { nearness(frame, outside); }, "object_nearness: got pixel (");
  }
  constexpr double infinite = std::numeric_limits<double>::infinity();
  for (const double reach : {0.0, -1.0, 1000.5, infinite, std::nan("")}) {
    expect_error<Error>([&] { nearness(frame, centre, reach); },
                        "object_nearness: got reach_px = ");
  }
  Instance instance;
  instance.mask = cv::Mat(4, 4, CV_32FC1, cv::Scalar(1));
  expect_error<Error>([&] { object_nearness(frame, centre, object_at(1, 2), 10, &instance); },
                      "object_nearness: got a mask of another type");
  expect_error<Error>([&] { nearness(FrameView(), {0, 0}); }, "object_nearness: got pixel (0, 0)");
  FrameView no_unit = frame;
  no_unit.depth = cv::Mat(100, 640, CV_16UC1, cv::Scalar(1));
  expect_error<Error>([&] { nearness(no_unit, centre); }, "object_nearness: got metres_per_unit");
}

}  // namespace
}  // namespace dynfilter::testing
