// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/input_placement.hpp"

#include <cstdint>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace dynfilter {
namespace {

using detail::Box;
using detail::box_in_image;
using detail::InputPlacement;
using detail::letterbox;
using detail::PlacedImage;
using detail::stretch;

const cv::Scalar grey = cv::Scalar::all(114);

cv::Mat random_image(cv::Size size, unsigned seed = 1) {
  std::mt19937 random(seed);
  cv::Mat image(size, CV_8UC3);
  for (std::size_t i = 0; i < image.total() * 3; ++i) image.data[i] = std::uint8_t(random() & 255U);
  return image;
}

void expect_at(const cv::Point2d& got, double x, double y) {
  EXPECT_NEAR(got.x, x, 1e-9);
  EXPECT_NEAR(got.y, y, 1e-9);
}

void expect_ways_are_inverse(const InputPlacement& placement) {
  for (const cv::Point2d point :
       {cv::Point2d(0, 0), cv::Point2d(17.25, 3.5), cv::Point2d(90, 71)}) {
    expect_at(placement.to_image(placement.to_input(point)), point.x, point.y);
  }
}

PlacedImage placed(cv::Size image, cv::Size input) {
  return letterbox(random_image(image), input, grey);
}

TEST(InputPlacement, LetterboxCentresAVideoImage) {
  const cv::Mat image = random_image({640, 480});
  const PlacedImage result = letterbox(image, {640, 640}, grey);
  ASSERT_EQ(result.pixels.size(), cv::Size(640, 640));
  EXPECT_EQ(cv::norm(result.pixels(cv::Rect(0, 80, 640, 480)), image, cv::NORM_INF), 0);
  EXPECT_EQ(result.pixels.at<cv::Vec3b>(79, 5), cv::Vec3b::all(114));
  EXPECT_EQ(result.pixels.at<cv::Vec3b>(560, 639), cv::Vec3b::all(114));
  expect_at(result.placement.to_input({0, 0}), 0, 80);
  expect_ways_are_inverse(result.placement);
}

TEST(InputPlacement, LetterboxRoundsTheResizedSides) {
  // 101x77 into 64x64: the factor is 64/101; 77 becomes 48.79, rounded 49; of 15 border rows 7 are
  // above.
  const PlacedImage result = placed({101, 77}, {64, 64});
  EXPECT_EQ(result.pixels.at<cv::Vec3b>(6, 30), cv::Vec3b::all(114));
  EXPECT_EQ(result.pixels.at<cv::Vec3b>(56, 30), cv::Vec3b::all(114));
  expect_at(result.placement.to_input({0, 0}), 0, 7);
  expect_at(result.placement.to_input({101, 77}), 64, 56);
  expect_ways_are_inverse(result.placement);
  // An upright image smaller than the input.
  const PlacedImage high = placed({10, 40}, {64, 80});
  expect_at(high.placement.to_input({10, 40}), 42, 80);
  expect_at(high.placement.to_input({0, 0}), 22, 0);
}

TEST(InputPlacement, PlacementMapsThePattern) {
  // Compares the centre of mass of a bright rectangle before and after.
  cv::Mat image(123, 211, CV_8UC3, cv::Scalar::all(0));
  image(cv::Rect(60, 30, 40, 20)).setTo(cv::Scalar::all(200));
  for (const PlacedImage& result :
       {letterbox(image, {320, 256}, cv::Scalar::all(0)), stretch(image, {320, 256})}) {
    cv::Mat channel;
    cv::extractChannel(result.pixels, channel, 0);
    channel.convertTo(channel, CV_32F);
    const cv::Moments moments = cv::moments(channel);
    const cv::Point2d centre = result.placement.to_input({80, 40});
    EXPECT_NEAR(moments.m10 / moments.m00 + 0.5, centre.x, 0.05);
    EXPECT_NEAR(moments.m01 / moments.m00 + 0.5, centre.y, 0.05);
    expect_ways_are_inverse(result.placement);
  }
}

TEST(InputPlacement, NormalizesChannelsInRgbOrder) {
  cv::Mat image(2, 3, CV_8UC3, cv::Scalar(10, 20, 30));
  image.at<cv::Vec3b>(1, 2) = {40, 50, 60};
  const cv::Mat tensor = detail::normalized_rgb({image, {}}, {1, 2, 3}, {2, 4, 8}).pixels;
  ASSERT_EQ(tensor.dims, 4);
  const auto at = [&](int channel, int y, int x) {
    return tensor.at<float>(cv::Vec4i(0, channel, y, x));
  };
  EXPECT_FLOAT_EQ(at(0, 0, 0), (30 - 1) / 2.0F);
  EXPECT_FLOAT_EQ(at(1, 0, 1), (20 - 2) / 4.0F);
  EXPECT_FLOAT_EQ(at(2, 1, 2), (40 - 3) / 8.0F);
}

TEST(InputPlacement, BoxesBecomeWholePixelsClippedToTheImage) {
  const InputPlacement placement = placed({640, 480}, {640, 640}).placement;
  EXPECT_EQ(box_in_image({10.5F, 90, 20, 100.25F}, placement), cv::Rect(10, 10, 10, 11));
  EXPECT_EQ(box_in_image({-50, 0, 700, 640}, placement), cv::Rect(0, 0, 640, 480));
  EXPECT_TRUE(box_in_image({10, 0, 20, 79}, placement).empty());  // in the border
  EXPECT_TRUE(box_in_image({700, 90, 800, 99}, placement).empty());
  EXPECT_EQ(box_in_image({-1e30F, -1e30F, 1e30F, 1e30F}, placement), cv::Rect(0, 0, 640, 480));
}

}  // namespace
}  // namespace dynfilter
