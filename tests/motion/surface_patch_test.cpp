// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/surface_patch.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/features.hpp"
#include "motion/patch.hpp"
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

using testing::brightness;

cv::Mat1b noise(std::uint64_t seed) {
  cv::Mat1b image(40, 50);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

TEST(Patch, HasTheBrightnessBetweenThePixels) {
  const cv::Mat1b image = noise(1);
  cv::RNG random(3);
  for (int i = 0; i < 50; ++i) {
    const cv::Point2f at(random.uniform(5.0F, 40.0F), random.uniform(5.0F, 34.0F));
    const auto patch = Patch::at(image, at, 4);
    for (int y = -4; y <= 4; ++y) {
      for (int x = -4; x <= 4; ++x) {
        const double expected = brightness(image, double{at.x} + x, double{at.y} + y);
        EXPECT_NEAR(double{(*patch)(y + 4, x + 4)}, expected, 1e-3);
      }
    }
  }
}

TEST(Patch, LiesInTheImage) {
  const cv::Mat1b image = noise(1);
  EXPECT_TRUE(Patch::at(image, {4, 4}, 4));
  EXPECT_FALSE(Patch::at(image, {3.9F, 10}, 4));
  EXPECT_FALSE(Patch::at(image, {46, 10}, 4));
  EXPECT_FALSE(Patch::at(image, {20, 37}, 4));
  EXPECT_FALSE(Patch::at(image, {10, NAN}, 4));
  EXPECT_FALSE(Patch::at(image, {20, 20}, -1));
  EXPECT_FALSE(Patch::at(image, {20, 20}, 1 << 30));
  EXPECT_TRUE(Patch::at(image, {20, 20}, 0));
}

}  // namespace
}  // namespace dynfilter::detail
