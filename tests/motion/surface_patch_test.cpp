// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/surface_patch.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/features.hpp"
#include "support/brightness.hpp"

namespace dynfilter::detail {
namespace {

using testing::brightness;

constexpr float person_m = 1.5F, wall_m = 3.0F;

cv::Mat1b patch_noise(std::uint64_t seed) {
  cv::Mat1b image(60, 80);
  cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

/// Frame with a person left of a column, before a wall.
FrameView person_left_of(int column) {
  FrameView frame;
  frame.depth = cv::Mat1f(60, 80, wall_m);
  frame.depth.colRange(0, column).setTo(person_m);
  return frame;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// The surface is the wall or the person; each pixel of the patch counts unless it lies in front.
TEST(SurfacePatch, IsTheMeanOverWhatDoesNotLieInFront) {
  const cv::Mat1b now = patch_noise(1), then = patch_noise(2);
  cv::RNG random(3);
  for (int i = 0; i < 100; ++i) {
    const FrameView frame = person_left_of(random.uniform(10, 70));
    const cv::Point2f at(random.uniform(5.0F, 70.0F), random.uniform(5.0F, 50.0F));
    const cv::Point2f place(random.uniform(5.0F, 70.0F), random.uniform(5.0F, 50.0F));
    const double depth_m = *frame.depth_m(nearest_pixel(at));
    std::vector<double> values, differences, deviations;
    for (int y = -3; y <= 3; ++y) {
      for (int x = -3; x <= 3; ++x) {
        if (*frame.depth_m(nearest_pixel(at) + cv::Point(x, y)) < depth_m - 0.15) continue;
        values.push_back(brightness(now, double{at.x} + x, double{at.y} + y));
        differences.push_back(
            std::abs(values.back() - brightness(then, double{place.x} + x, double{place.y} + y)));
      }
    }
    for (const double value : values) deviations.push_back(std::abs(value - mean_of(values)));
    const auto patch = SurfacePatch::around(frame, now, at, depth_m);
    EXPECT_NEAR(patch->contrast(), mean_of(deviations), 1e-3);
    EXPECT_NEAR(*patch->difference(then, place), mean_of(differences), 1e-3);
  }
}

/// A person walks by. Two pixels beside him, the wall has not changed.
TEST(SurfacePatch, DoesNotSeeWhoPassesBeside) {
  const cv::Mat1b now = patch_noise(1);
  cv::Mat1b then = now.clone();
  patch_noise(2).colRange(0, 40).copyTo(then.colRange(0, 40));
  const cv::Point2f at(42, 30);
  const auto patch = SurfacePatch::around(person_left_of(40), now, at, double{wall_m});
  EXPECT_EQ(*patch->difference(then, at), 0);
  EXPECT_GT(*SurfacePatch::around(person_left_of(40), now, at, {})->difference(then, at), 10);
}

TEST(SurfacePatch, HasNoAnswerOutsideTheImage) {
  const cv::Mat1b image = patch_noise(1);
  const FrameView frame = person_left_of(40);
  EXPECT_FALSE(SurfacePatch::around(frame, image, {2.9F, 30}, 1.5));
  EXPECT_FALSE(SurfacePatch::around(frame, image, {NAN, 30}, 1.5));
  EXPECT_FALSE(SurfacePatch::around(frame, cv::Mat1b(), {20, 30}, 1.5));
  const auto patch = SurfacePatch::around(frame, image, {20, 30}, 1.5);
  EXPECT_FALSE(patch->difference(image, {20, 57}));
  EXPECT_FALSE(patch->difference(image, {NAN, 30}));
  EXPECT_EQ(*patch->difference(image, {20, 30}), 0);
}

/// A sensor cannot see beside a person: the gap shows the wall.
TEST(SurfaceDepth, IsThatOfWhatLiesBehindAGap) {
  FrameView frame = person_left_of(40);
  frame.depth.colRange(40, 50).setTo(0);
  EXPECT_EQ(surface_depth(frame, {39, 30}), double{person_m});
  EXPECT_EQ(surface_depth(frame, {40, 30}), double{wall_m});
  EXPECT_EQ(surface_depth(frame, {49, 30}), double{wall_m});
  frame.depth.colRange(40, 61).setTo(0);
  EXPECT_EQ(surface_depth(frame, {40, 30}), double{person_m});  // the wall is 21 pixels away
  frame.depth.setTo(0);
  EXPECT_FALSE(surface_depth(frame, {40, 30}));
  EXPECT_FALSE(surface_depth({}, {40, 30}));
}

TEST(SurfaceDepth, LooksInEightDirectionsForTwentySteps) {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      FrameView frame;
      frame.depth = cv::Mat1f(60, 80, 0.0F);
      frame.depth.at<float>(30 + 20 * dy, 40 + 20 * dx) = 2;
      EXPECT_EQ(surface_depth(frame, {40, 30}), 2.0);
      EXPECT_FALSE(surface_depth(frame, {40 - dx, 30 - dy}));  // 21 steps away
    }
  }
}

/// Features without a finite position have such pixels.
TEST(SurfaceDepth, IsUnknownOutsideTheImage) {
  const FrameView frame = person_left_of(40);
  EXPECT_FALSE(surface_depth(frame, {-1, 30}));
  EXPECT_FALSE(surface_depth(frame, {80, 30}));
  EXPECT_FALSE(surface_depth(frame, nearest_pixel({NAN, 30})));
  EXPECT_FALSE(surface_depth(frame, {std::numeric_limits<int>::max(), 30}));
}

}  // namespace
}  // namespace dynfilter::detail
