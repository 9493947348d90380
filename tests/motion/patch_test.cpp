// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/patch.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/brightness.hpp"

namespace dynfilter::detail {
namespace {

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
