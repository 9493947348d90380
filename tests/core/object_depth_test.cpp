// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/object_depth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "support/depth_oracle.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

/// Wall at 4 m in 640x480, of which every fourth pixel is read; a mask of 80x80 pixels, which has
/// 20x20 readings, in a box of 120x120.
struct ObjectScene {
  FrameView frame;
  Instance instance;

  ObjectScene() {
    frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(4.0F));
    instance = Instance::from_box({180, 180, 120, 120});
    instance.mask_origin = {200, 200};
    instance.mask = cv::Mat(80, 80, CV_8UC1, cv::Scalar(255));
  }

  /// Sets the depth of each pixel in the columns [first, end) of the mask.
  void set_columns(int first, int end, const std::function<double(int, int)>& depth_m) {
    for (int y = 0; y < 80; ++y) {
      for (int x = first; x < end; ++x) {
        frame.depth.at<float>(200 + y, 200 + x) = static_cast<float>(depth_m(x, y));
      }
    }
  }

  void set_columns(int first, int end, double depth_m) {
    set_columns(first, end, [=](int, int) { return depth_m; });
  }

  ObjectDepth estimate() const { return ObjectDepthEstimator(0.4).estimate(frame, instance); }
};

TEST(ObjectDepth, ReachesFortyFiveCentimetresByDefault) {
  ObjectScene scene;
  scene.set_columns(0, 80, 1.5);
  const ObjectDepth depth = ObjectDepthEstimator().estimate(scene.frame, scene.instance);
  EXPECT_NEAR(depth.mask_range_m.lower, 1.05, 1e-6);
  EXPECT_NEAR(depth.mask_range_m.upper, 1.95, 1e-6);
}

TEST(ObjectDepth, FlatObjectHasTheMinimumWidth) {
  ObjectScene scene;
  scene.set_columns(0, 80, 1.5);
  const ObjectDepth depth = scene.estimate();
  EXPECT_EQ(depth.samples, 400U);
  EXPECT_NEAR(depth.mask_range_m.lower, 1.1, 1e-6);
  EXPECT_NEAR(depth.mask_range_m.upper, 1.9, 1e-6);
  EXPECT_TRUE(depth.box_range_m.empty());
  EXPECT_FALSE(depth.empty());
  EXPECT_EQ(depth.hull_m().upper, depth.mask_range_m.upper);
}

/// A stale mask may hold only a twentieth of the object; the nearest cluster of that size wins.
TEST(ObjectDepth, PrefersTheNearestClusterToTheLargest) {
  ObjectScene scene;
  scene.set_columns(0, 4, 1.5);  // 20 of 400 readings
  EXPECT_NEAR(scene.estimate().mask_range_m.upper, 1.9, 1e-6);
  scene.frame.depth.at<float>(202, 202) = 4.0F;  // 19 are left
  EXPECT_NEAR(scene.estimate().mask_range_m.upper, 4.4, 1e-6);
}

TEST(ObjectDepth, UsesTheMiddleOfTheBoxWithoutAMask) {
  ObjectScene scene;
  scene.set_columns(0, 80, 1.5);
  scene.instance.mask = cv::Mat();
  const ObjectDepth depth = scene.estimate();
  EXPECT_TRUE(depth.mask_range_m.empty());
  EXPECT_NEAR(depth.box_range_m.lower, 1.1, 1e-6);
  EXPECT_NEAR(depth.box_range_m.upper, 1.9, 1e-6);
  EXPECT_EQ(depth.samples, 15U * 18U) << "of 60x72 pixels";
}

TEST(ObjectDepth, UsesMaskAndBoxIfTheMaskIsSmall) {
  ObjectScene scene;
  scene.set_columns(0, 80, 2.0);
  scene.set_columns(0, 16, 1.0);
  scene.instance.mask = cv::Mat(16, 16, CV_8UC1, cv::Scalar(1));  // 16 of 900 readings
  ObjectDepth depth = scene.estimate();
  EXPECT_NEAR(depth.mask_range_m.lower, 0.6, 1e-6);
  EXPECT_NEAR(depth.mask_range_m.upper, 1.4, 1e-6);
  EXPECT_NEAR(depth.box_range_m.upper, 2.4, 1e-6);
  EXPECT_NEAR(depth.hull_m().lower, 0.6, 1e-6);
  EXPECT_NEAR(depth.hull_m().upper, 2.4, 1e-6);
  scene.instance.mask = cv::Mat(32, 16, CV_8UC1, cv::Scalar(1));
  EXPECT_TRUE(scene.estimate().box_range_m.empty()) << "the mask alone is large enough";
}

TEST(ObjectDepth, NeedsEightDepths) {
  ObjectScene scene;
  scene.frame.depth.setTo(0);
  for (int i = 0; i < 7; ++i) scene.frame.depth.at<float>(202, 202 + 4 * i) = 1.5F;
  ObjectDepth depth = scene.estimate();
  EXPECT_TRUE(depth.empty());
  EXPECT_EQ(depth.samples, 7U);
  scene.frame.depth.at<float>(242, 242) = 1.5F;
  EXPECT_TRUE(scene.estimate().contains(1.5));
  scene.frame.depth = cv::Mat();
  depth = scene.estimate();
  EXPECT_TRUE(depth.empty());
  EXPECT_EQ(depth.samples, 0U);
}

TEST(ObjectDepth, IsEmptyIfAllDepthsAreOutOfRange) {
  for (const float far : {51.2F, 65.535F, 1e10F, 1e30F, std::numeric_limits<float>::max()}) {
    ObjectScene scene;
    scene.frame.depth.setTo(far);
    EXPECT_TRUE(scene.estimate().empty()) << far;
    scene.set_columns(0, 40, 1.5);
    EXPECT_NEAR(scene.estimate().mask_range_m.lower, 1.1, 1e-6) << far;
    EXPECT_NEAR(scene.estimate().mask_range_m.upper, 1.9, 1e-6) << far;
  }
  ObjectScene scene;
  scene.frame.depth.setTo(std::numeric_limits<float>::max());
  scene.frame.metres_per_unit = 1000;  // beyond float, but finite
  EXPECT_TRUE(scene.estimate().empty());
}

TEST(ObjectDepth, AcceptsTinyAndHugeWidths) {
  ObjectScene scene;
  scene.set_columns(0, 80, 1.53);
  const auto range_of = [&](double half_width_m) {
    return ObjectDepthEstimator(half_width_m).estimate(scene.frame, scene.instance).mask_range_m;
  };
  EXPECT_TRUE(range_of(0.01).contains(1.53));
  EXPECT_GT(range_of(0.01).lower, 1.4);
  EXPECT_LT(range_of(0.01).upper, 1.66);
  for (const double half_width_m : {60.0, 1e300}) {
    EXPECT_TRUE(range_of(half_width_m).contains(4.0)) << half_width_m;
  }
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
