// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/object_depth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "support/depth_oracle.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

/// A wall at 4 m and an object at 1.5 m, with its mask of 80x80 pixels in a box of 120x120.
struct ObjectScene {
  FrameView frame;
  Instance instance;

  ObjectScene() {
    frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(4.0F));
    frame.depth(cv::Rect(200, 200, 80, 80)).setTo(1.5F);
    instance = Instance::from_box({180, 180, 120, 120});
    instance.mask_origin = {200, 200};
    instance.mask = cv::Mat(80, 80, CV_8UC1, cv::Scalar(255));
  }

  ObjectDepth estimate() const { return ObjectDepthEstimator(0.4).estimate(frame, instance); }
};

TEST(ObjectDepth, ReachesFortyFiveCentimetresByDefault) {
  const ObjectScene scene;
  const ObjectDepth depth = ObjectDepthEstimator().estimate(scene.frame, scene.instance);
  EXPECT_NEAR(depth.mask_range_m.lower, 1.05, 1e-6);
  EXPECT_NEAR(depth.mask_range_m.upper, 1.95, 1e-6);
}

TEST(ObjectDepth, MatchesTheOracleOnHostileInput) {
  std::size_t by_mask = 0, by_box = 0;
  std::vector<float> scratch;  // reused by all calls
  for (std::uint64_t seed = 0; seed < 2500; ++seed) {
    ByteSource source(seed);
    const int width = source.chance(3) ? source.between(230, 700) : source.between(1, 40);
    const cv::Size size(width, source.between(1, 30));
    FrameView frame;
    const bool floating = source.chance(50);
    frame.depth = arbitrary_depth(source, size, floating);
    frame.metres_per_unit = source.between(1, 60) / (floating ? 10.0 : 50000.0);
    const Instance instance = arbitrary_instance(source, size);
    const double half_width_m = source.between(1, 90) / 100.0;
    const OracleObject expected = oracle_object(frame, instance, half_width_m);
    const ObjectDepth depth = ObjectDepthEstimator(half_width_m).estimate(frame, instance, scratch);
    ASSERT_EQ(depth.samples, expected.samples) << "seed " << seed;
    ASSERT_EQ(depth.empty(), expected.ranges.empty()) << "seed " << seed;
    by_mask += depth.mask_range_m.empty() ? 0 : 1;
    by_box += depth.box_range_m.empty() ? 0 : 1;
    ASSERT_EQ(!depth.box_range_m.empty(), expected.by_box) << "seed " << seed;
    if (depth.empty()) continue;
    ASSERT_NEAR(depth.hull_m().lower, expected.hull().lower, 1e-9) << "seed " << seed;
    ASSERT_NEAR(depth.hull_m().upper, expected.hull().upper, 1e-9) << "seed " << seed;
    for (double metres = 0; metres < 15; metres += 0.0137) {
      ASSERT_EQ(depth.contains(metres), expected.has(metres)) << "seed " << seed;
    }
  }
  EXPECT_GT(by_mask, 600U);
  EXPECT_GT(by_box, 100U);
}

TEST(ObjectDepth, NamesMisuse) {
  for (const double bad : {0.0, -0.1, std::numeric_limits<double>::infinity(), std::nan("")}) {
    expect_error<std::invalid_argument>([&] { ObjectDepthEstimator{bad}; },
                                        "dynfilter::ObjectDepthEstimator: got half_width_m = ");
  }
  ObjectScene scene;
  scene.frame.depth = cv::Mat(480, 640, CV_64FC1, cv::Scalar(1));
  expect_error<std::invalid_argument>([&] { scene.estimate(); },
                                      "ObjectDepthEstimator: got a depth image of type CV_64FC1");
}

}  // namespace
}  // namespace dynfilter::testing
