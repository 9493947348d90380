// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/image_patch.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace dynfilter::detail {
namespace {

constexpr int left = 4, right = 3, reach = 7;  // of a patch around its centre

cv::Mat1b texture(std::uint64_t seed) {
  cv::Mat1b image(90, 120);
  cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {}, 1.5);
  cv::normalize(image, image, 20, 235, cv::NORM_MINMAX);
  return image;
}

double interpolated(const cv::Mat1b& image, double x, double y) {
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const double dx = x - x0, dy = y - y0;
  return (1 - dy) * ((1 - dx) * image(y0, x0) + dx * image(y0, x0 + 1)) +
         dy * ((1 - dx) * image(y0 + 1, x0) + dx * image(y0 + 1, x0 + 1));
}

/// Oracle: differences in double, pixel by pixel, and a Gauss-Newton step by gradients of the patch
/// without their mean.
ImagePatch::Look looked(const cv::Mat1b& from, cv::Point at, const cv::Mat1b& to,
                        cv::Point2f place) {
  double n = 0, sum = 0, squares = 0, mean_x = 0, mean_y = 0;
  const auto for_each = [&](const auto& action) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -left; x <= right; ++x) {
        const cv::Point p = at + cv::Point(x, y);
        const double off = interpolated(to, double{place.x} + x, double{place.y} + y) - from(p);
        action(off, (from(p.y, p.x + 1) - from(p.y, p.x - 1)) / 2.0,
               (from(p.y + 1, p.x) - from(p.y - 1, p.x)) / 2.0);
      }
    }
  };
  for_each([&](double off, double gx, double gy) {
    ++n;
    sum += off;
    squares += off * off;
    mean_x += gx;
    mean_y += gy;
  });
  mean_x = std::round(2 * mean_x / n) / 2;  // it is kept in half grey levels
  mean_y = std::round(2 * mean_y / n) / 2;
  cv::Matx22d matrix = cv::Matx22d::zeros();
  cv::Vec2d right_side;
  for_each([&](double off, double gx, double gy) {
    const cv::Vec2d g(gx - mean_x, gy - mean_y);
    matrix += g * g.t();
    right_side += off * g;
  });
  const cv::Vec2d step = -(matrix.inv() * right_side);
  return {static_cast<float>(std::sqrt(squares / n - sum / n * sum / n)),
          cv::Point2f(static_cast<float>(step[0]), static_cast<float>(step[1]))};
}

TEST(ImagePatch, ComparesAsTheOracle) {
  const cv::Mat1b from = texture(1), to = texture(2);
  cv::RNG random(3);
  for (int i = 0; i < 300; ++i) {
    const cv::Point at(random.uniform(10, 110), random.uniform(10, 80));
    const cv::Point2f place(random.uniform(10.F, 108.F), random.uniform(10.F, 78.F));
    ImagePatch patch;
    patch.read(from, at);
    const ImagePatch::Look got = patch.look(to, place), want = looked(from, at, to, place);
    ASSERT_TRUE(got.is_inside());
    EXPECT_NEAR(got.difference, want.difference, 0.3F);
    EXPECT_LT(cv::norm(got.step - want.step), 0.03 * cv::norm(want.step) + 0.05);
  }
}

TEST(ImagePatch, FindsAShiftThroughAChangeOfExposure) {
  const cv::Mat1b from = texture(4);
  cv::RNG random(5);
  int found = 0;
  for (int i = 0; i < 100; ++i) {
    const cv::Point2f shift(random.uniform(-1.5F, 1.5F), random.uniform(-1.5F, 1.5F));
    cv::Mat1b to;
    const cv::Matx23f move(1, 0, shift.x, 0, 1, shift.y);
    cv::warpAffine(from, to, move, from.size());
    to += cv::Scalar(15);
    const cv::Point at(random.uniform(20, 100), random.uniform(20, 70));
    ImagePatch patch;
    patch.read(from, at);
    const ImagePatch::Match match = patch.follow(to, at, 8);
    found += match.has_settled && cv::norm(match.place - cv::Point2f(at) - shift) < 0.15 ? 1 : 0;
    EXPECT_LE(match.difference, match.first + 1e-3F);
  }
  EXPECT_GE(found, 90);
}

TEST(ImagePatch, ReachesToTheBorderAndNotBeyond) {
  const cv::Mat1b image = texture(6);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      ImagePatch patch;
      patch.read(image, {x, y});
      const bool is_inside = x - left >= 1 && x + right + 1 < image.cols && y - reach >= 1 &&
                             y + reach + 1 < image.rows;
      EXPECT_EQ(patch.texture() > 0, is_inside) << x << ' ' << y;
    }
  }
  ImagePatch patch;
  patch.read(image, {50, 40});
  for (const cv::Point2f out : {cv::Point2f(3.9F, 40),
                                {50, 6.9F},
                                {116.5F, 40},
                                {50, 82.5F},
                                {NAN, 40},
                                {-1e9F, 40},
                                {50, 1e9F}}) {
    EXPECT_FALSE(patch.look(image, out).is_inside()) << out;
    EXPECT_FALSE(patch.follow(image, out, 4).has_settled);
  }
}

TEST(ImagePatch, CannotFollowAPlainWallOrAnEdge) {
  cv::Mat1b image(40, 40, std::uint8_t{90});
  ImagePatch patch;
  patch.read(image, {20, 20});
  EXPECT_EQ(patch.texture(), 0);
  EXPECT_EQ(patch.contrast(), 0);
  image.colRange(20, 40).setTo(200);
  patch.read(image, {20, 20});
  EXPECT_EQ(patch.texture(), 0);
  EXPECT_NEAR(patch.contrast(), 55, 0.5);
}

}  // namespace
}  // namespace dynfilter::detail
