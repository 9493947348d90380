// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/motion_residual.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "dynfilter/features.hpp"

namespace dynfilter::detail {
namespace {

constexpr double unlimited_m = std::numeric_limits<double>::infinity();
const PinholeCamera tum_camera{535, 539, 320, 247};

RelativePose pose_of(const cv::Vec3d& turn, const cv::Vec3d& translation) {
  RelativePose pose;
  pose.rotation = {1, -turn[2], turn[1], turn[2], 1, -turn[0], -turn[1], turn[0], 1};
  pose.translation = translation;
  return pose;
}

/// Oracle: tries depths, equally spaced in their inverse.
double tried_residual(const RelativePose& pose, cv::Point2d now, cv::Point2d then,
                      const DepthInterval& depth) {
  constexpr int steps = 200000;
  double least = unlimited_m;
  const double low = 1 / depth.farthest_m, high = 1 / depth.nearest_m;
  for (int i = 0; i <= steps; ++i) {
    const double inverse_depth = low + (high - low) * i / steps;
    const cv::Vec3d ray((now.x - tum_camera.cx) / tum_camera.fx,
                        (now.y - tum_camera.cy) / tum_camera.fy, 1);
    const cv::Vec3d there = pose.rotation * ray + pose.translation * inverse_depth;
    const double depth_m = 1 / inverse_depth;
    const bool is_in_gap = depth_m > depth.gap_nearest_m && depth_m < depth.gap_farthest_m;
    if (!(there[2] > 0) || is_in_gap) continue;
    const cv::Point2d place(tum_camera.fx * there[0] / there[2] + tum_camera.cx,
                            tum_camera.fy * there[1] / there[2] + tum_camera.cy);
    least = std::min(least, cv::norm(then - place));
  }
  return least;
}

TEST(MotionResidual, IsTheLeastDistanceOverAllDepths) {
  cv::RNG random(3);
  for (int i = 0; i < 60; ++i) {
    const auto draw = [&](double reach) { return random.uniform(-reach, reach); };
    const RelativePose pose =
        pose_of({draw(0.05), draw(0.05), draw(0.05)}, {draw(0.1), draw(0.1), draw(0.1)});
    const cv::Point2d now(random.uniform(0.0, 640.0), random.uniform(0.0, 480.0));
    const cv::Point2d then = now + cv::Point2d(draw(40), draw(40));
    const double nearest = random.uniform(0.5, 3.0);
    DepthInterval depth{nearest, i % 3 == 0 ? unlimited_m : nearest + random.uniform(0.0, 2.0)};
    if (i % 2 == 0) {
      depth.gap_nearest_m = nearest + random.uniform(0.0, 0.1);
      depth.gap_farthest_m = std::min(nearest + random.uniform(0.1, 1.0), depth.farthest_m);
    }
    const auto residual = motion_residual(tum_camera, pose, now, then, depth);
    ASSERT_TRUE(residual);
    EXPECT_NEAR(residual->distance_px, tried_residual(pose, now, then, depth), 1e-3) << i;
    EXPECT_NEAR(cv::norm(then - residual->static_place), residual->distance_px, 1e-9);
  }
}

TEST(MotionResidual, IgnoresDepthsBehindTheEarlierCamera) {
  // The camera moved 1 m back: what is nearer than 1 m now was behind it then.
  RelativePose pose;
  pose.translation = {0, 0, -1};
  const cv::Point2d now(400, 300), then(460, 340);
  const auto residual = motion_residual(tum_camera, pose, now, then, {0.4, 3});
  ASSERT_TRUE(residual);
  EXPECT_NEAR(residual->distance_px, tried_residual(pose, now, then, {0.4, 3}), 1e-2);
  EXPECT_FALSE(motion_residual(tum_camera, pose, now, then, {0.4, 0.9}));
}

TEST(MotionResidual, IsZeroForAStaticPointAtItsDepth) {
  const RelativePose pose = pose_of({0.01, -0.02, 0.005}, {0.03, -0.01, 0.02});
  const cv::Point2d now(123, 321);
  const auto then = tum_camera.project(pose * tum_camera.point(now, 1.7));
  EXPECT_NEAR(motion_residual(tum_camera, pose, now, *then, {1.7, 1.7})->distance_px, 0, 1e-9);
  EXPECT_NEAR(motion_residual(tum_camera, pose, now, *then, {1.5, 2.0})->distance_px, 0, 1e-9);
  // Without depth it still lies on the segment; at a wrong depth it does not.
  EXPECT_NEAR(motion_residual(tum_camera, pose, now, *then, DepthInterval())->distance_px, 0, 1e-9);
  EXPECT_GT(motion_residual(tum_camera, pose, now, *then, {3, 4})->distance_px, 3);
}

/// At the edge of a thing that moves, a depth between it and the wall would explain its motion.
TEST(MotionResidual, IsNotHiddenByTheDepthsOfAGap) {
  const RelativePose pose = pose_of({0, 0, 0}, {0.02, 0, 0});
  const cv::Point2d now(300, 200);
  const cv::Point3d thing = tum_camera.point(now, 1.3) - cv::Point3d(0.005, 0, 0);
  const cv::Point2d then = *tum_camera.project(pose * thing);
  DepthInterval depth{1.28, 3.1};
  EXPECT_NEAR(motion_residual(tum_camera, pose, now, then, depth)->distance_px, 0, 1e-9);
  depth.gap_nearest_m = 1.32;
  depth.gap_farthest_m = 2.9;
  EXPECT_TRUE(depth.has_gap());
  // It is nearer to where the thing would have been than to the wall's place.
  const auto expected = tum_camera.project(pose * tum_camera.point(now, 1.32));
  EXPECT_NEAR(motion_residual(tum_camera, pose, now, then, depth)->distance_px,
              cv::norm(then - *expected), 1e-9);
  EXPECT_GT(cv::norm(then - *expected), 1.5);
}

/// Oracle: sorts the depths of the window, and splits them in the middle of their range.
DepthInterval sorted_interval(const cv::Mat_<std::uint16_t>& depth, cv::Point pixel) {
  std::vector<double> depths_m;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const bool is_inside = std::abs(x - pixel.x) <= 4 && std::abs(y - pixel.y) <= 4;
      if (is_inside && depth(y, x) != 0) depths_m.push_back(depth(y, x) / 5000.0);
    }
  }
  if (depths_m.empty()) return {0.4, unlimited_m};
  std::sort(depths_m.begin(), depths_m.end());
  const auto sigma = [](double m) { return 0.0025 * m * m; };
  const auto nearer = [&](double m) { return m - 2 * sigma(m); };
  const auto farther = [&](double m) { return m + 2 * sigma(m); };
  DepthInterval interval{nearer(depths_m.front()), farther(depths_m.back())};
  const double middle_m = (depths_m.front() + depths_m.back()) / 2;
  const auto after = std::upper_bound(depths_m.begin(), depths_m.end(), middle_m);
  if (after != depths_m.end() && *after - *(after - 1) >= 0.3) {
    interval.gap_nearest_m = farther(*(after - 1));
    interval.gap_farthest_m = nearer(*after);
  }
  return interval;
}

TEST(DepthInterval, SpansTheWindowAndTheNoise) {
  cv::RNG random(5);
  cv::Mat_<std::uint16_t> depth(40, 50);
  for (std::uint16_t& pixel : depth) {
    pixel = static_cast<std::uint16_t>(random.uniform(0, 9) < 8 ? 0 : random.uniform(5000, 20000));
  }
  FrameView frame;
  frame.depth = depth;
  frame.metres_per_unit = 1.0 / 5000;
  std::size_t gaps = 0;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) {
      const DepthInterval interval = depth_interval(frame, {x, y});
      const DepthInterval want = sorted_interval(depth, {x, y});
      ASSERT_NEAR(interval.nearest_m, want.nearest_m, 1e-12);
      ASSERT_EQ(interval.is_known(), want.is_known());
      if (want.is_known()) {
        ASSERT_NEAR(interval.farthest_m, want.farthest_m, 1e-12);
      }
      ASSERT_EQ(interval.has_gap(), want.has_gap());
      if (want.has_gap()) {
        ++gaps;
        ASSERT_NEAR(interval.gap_nearest_m, want.gap_nearest_m, 1e-12);
        ASSERT_NEAR(interval.gap_farthest_m, want.gap_farthest_m, 1e-12);
      }
    }
  }
  EXPECT_GT(gaps, 500U);
  EXPECT_LT(gaps, 1800U);
}

TEST(DepthInterval, IsUnknownOutsideTheImageAndWithoutDepth) {
  FrameView frame;
  EXPECT_FALSE(depth_interval(frame, {5, 5}).is_known());
  frame.depth = cv::Mat1f(20, 20, 1.0F);
  EXPECT_TRUE(depth_interval(frame, {19, 19}).is_known());
  EXPECT_FALSE(depth_interval(frame, {20, 19}).is_known());
  EXPECT_FALSE(depth_interval(frame, nearest_pixel({NAN, 0})).is_known());
  EXPECT_EQ(depth_interval(frame, {-1, 0}).nearest_m, 0.4);
}

}  // namespace
}  // namespace dynfilter::detail
