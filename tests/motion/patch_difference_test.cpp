// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/patch_difference.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/brightness.hpp"

namespace dynfilter {
namespace {

using testing::brightness;

cv::Mat1b noise(std::uint64_t seed) {
  cv::Mat1b image(40, 50);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

TEST(PatchDifference, IsTheMeanOverThePatch) {
  const cv::Mat1b a = noise(1), b = noise(2);
  cv::RNG random(3);
  for (int i = 0; i < 50; ++i) {
    const cv::Point2f at(random.uniform(5.0F, 40.0F), random.uniform(5.0F, 34.0F));
    const cv::Point2f other(random.uniform(5.0F, 40.0F), random.uniform(5.0F, 34.0F));
    double difference = 0, mean = 0, contrast = 0;
    for (int y = -4; y <= 4; ++y) {
      for (int x = -4; x <= 4; ++x) {
        difference += std::abs(brightness(a, double{at.x} + x, double{at.y} + y) -
                               brightness(b, double{other.x} + x, double{other.y} + y)) /
                      81;
        mean += brightness(a, double{at.x} + x, double{at.y} + y) / 81;
      }
    }
    for (int y = -4; y <= 4; ++y) {
      for (int x = -4; x <= 4; ++x)
        contrast += std::abs(brightness(a, double{at.x} + x, double{at.y} + y) - mean) / 81;
    }
    EXPECT_NEAR(*patch_difference(a, at, b, other), difference, 1e-3);
    EXPECT_NEAR(*patch_contrast(a, at), contrast, 1e-3);
  }
}

TEST(PatchDifference, HasNoAnswerOutsideTheImage) {
  const cv::Mat1b image = noise(1);
  EXPECT_TRUE(patch_contrast(image, {4, 4}));
  EXPECT_FALSE(patch_contrast(image, {3.9F, 10}));
  EXPECT_FALSE(patch_contrast(image, {46, 10}));
  EXPECT_FALSE(patch_contrast(image, {10, NAN}));
  EXPECT_FALSE(patch_contrast(image, {20, 20}, -1));
  EXPECT_FALSE(patch_contrast(image, {20, 20}, 1 << 30));
  EXPECT_EQ(*patch_contrast(image, {20, 20}, 0), 0);
  EXPECT_FALSE(patch_difference(image, {20, 20}, image, {20, 37}));
  EXPECT_EQ(*patch_difference(image, {20, 20}, image, {20, 20}), 0);
}

}  // namespace
}  // namespace dynfilter
