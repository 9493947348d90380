// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "segmenters/propagation/point_flow.hpp"

#include "support/test.hpp"

namespace dynfilter::detail {
namespace {

constexpr int spacing = 8, cell = 2 * spacing;
const cv::Size size(320, 240);

/// Texture whose contrast grows from left to right, from none.
cv::Mat1b fading_texture() {
  cv::Mat1f noise(size);
  cv::RNG(5).fill(noise, cv::RNG::NORMAL, 0, 1);
  cv::GaussianBlur(noise, noise, cv::Size(), 1.5);
  cv::Mat1b image(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float contrast = 100 * static_cast<float>(x) / static_cast<float>(size.width);
      image(y, x) = cv::saturate_cast<uchar>(128 + contrast * noise(y, x));
    }
  }
  return image;
}

/// Oracle: the strongest corner of each cell whose least eigenvalue is at least 1e-4.
TEST(PointFlow, FollowsTheStrongestCornerOfEachTexturedCell) {
  const cv::Mat1b image = fading_texture();
  cv::Mat strength;
  cv::cornerMinEigenVal(image, strength, 3);
  std::set<std::pair<int, int>> corners;
  std::size_t faint = 0;
  for (int y = 0; y < size.height; y += cell) {
    for (int x = 0; x < size.width; x += cell) {
      double strongest = 0;
      cv::Point place;
      cv::minMaxLoc(strength(cv::Rect(x, y, cell, cell)), nullptr, &strongest, nullptr, &place);
      if (strongest >= 1e-4) {
        corners.insert({x + place.x, y + place.y});
      } else if (strongest > 2e-5) {
        ++faint;  // the tracker alone would follow it
      }
    }
  }
  ASSERT_GT(corners.size(), 100U);
  ASSERT_GT(faint, 5U);
  PointFlow flow;
  flow.track(image);
  flow.choose_points({});
  std::set<std::pair<int, int>> followed;
  for (const PointMotion& motion : flow.track(image)) {
    EXPECT_LT(cv::norm(motion.shift()), 0.1);
    followed.insert({cvRound(motion.from.x), cvRound(motion.from.y)});
  }
  EXPECT_EQ(followed, corners);
}

TEST(PointFlow, FollowsNothingInAnImageOfLessThanTwoWindows) {
  for (const int side : {12, 17, 18, 64}) {
    cv::Mat1b image(side, 64);
    cv::RNG(6).fill(image, cv::RNG::UNIFORM, 0, 256);
    PointFlow flow;
    flow.track(image);
    flow.choose_points({});
    EXPECT_EQ(flow.track(image).empty(), side < 18) << side;
  }
}

TEST(PointFlow, WorksOnLargeImagesAtOneSize) {
  cv::Mat large;
  cv::resize(fading_texture(), large, {4 * size.width, 4 * size.height}, 0, 0, cv::INTER_CUBIC);
  std::vector<std::size_t> followed;
  for (const int width : {640, 1280}) {
    cv::Mat image;
    cv::resize(large, image, {width, width * size.height / size.width}, 0, 0, cv::INTER_AREA);
    PointFlow flow;
    flow.track(image);
    flow.choose_points({{{}, image.size()}});
    followed.push_back(flow.track(image).size());
  }
  EXPECT_GT(followed[0], 100U);
  EXPECT_NEAR(double(followed[1]), double(followed[0]), 0.1 * double(followed[0]));
}

TEST(PointFlow, ChoosesPointsDenselyInRectangles) {
  cv::Mat1b image(size);
  cv::RNG(6).fill(image, cv::RNG::UNIFORM, 0, 256);
  PointFlow flow;
  const auto followed = [&](const std::vector<cv::Rect>& dense) {
    flow.track(image);
    flow.choose_points(dense);
    return flow.track(image).size();
  };
  const std::size_t cells = static_cast<std::size_t>(size.area() / (cell * cell));
  EXPECT_EQ(followed({}), cells);
  EXPECT_EQ(followed({{0, 0, cell, cell}}), cells + 3);
  EXPECT_EQ(followed({{cell - 1, 0, 2, 1}}), cells + 6) << "it reaches into two cells";
  EXPECT_EQ(followed({{0, 0, 0, 0}}), cells) << "it is empty";
  EXPECT_EQ(followed({{{}, size}}), 4 * cells);
}

}  // namespace
}  // namespace dynfilter::detail
