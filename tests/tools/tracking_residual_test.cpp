// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "tracking_residual.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace dynfilter::tools {
namespace {

constexpr double focal_px = 200;
constexpr double wall_m = 2;

CameraParameters camera() {
  CameraParameters camera;
  camera.fx = camera.fy = focal_px;
  camera.cx = 159.5;
  camera.cy = 119.5;
  camera.image_size = {320, 240};
  return camera;
}

/// A textured wall at 2 m, seen by a camera that was moved by this many pixels to the left.
FrameView wall(int shift_px, cv::Mat& image, cv::Mat& depth) {
  cv::Mat texture(240, 400, CV_8UC3);
  cv::RNG random(7);
  random.fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {7, 7}, 1.5);
  image = texture(cv::Rect(40 - shift_px, 0, 320, 240)).clone();
  depth = cv::Mat(240, 320, CV_32FC1, cv::Scalar(wall_m));
  FrameView frame;
  frame.image = image;
  frame.depth = depth;
  return frame;
}

WorldPose moved(double left_px) {
  return {cv::Matx33d::eye(), {-left_px * wall_m / focal_px, 0, 0}};
}

std::vector<cv::KeyPoint> grid() {
  std::vector<cv::KeyPoint> keypoints;
  for (int y = 30; y < 220; y += 15) {
    for (int x = 30; x < 300; x += 15) {
      keypoints.emplace_back(static_cast<float>(x), static_cast<float>(y), 7.0F);
    }
  }
  return keypoints;
}

/// Returns the text for a camera that moves by 3 px, while its pose says `said_px`. Noise covers
/// the second image in that rectangle.
std::string measured(double said_px, const cv::Rect& covered = {}) {
  TrackingResidual residual(camera());
  cv::Mat images[2], depths[2];
  residual.add(wall(0, images[0], depths[0]), Segmentation{}, grid(), moved(0));
  const FrameView second = wall(3, images[1], depths[1]);
  cv::Mat noise = images[1](covered);
  if (!covered.empty()) cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
  residual.add(second, Segmentation{}, grid(), moved(said_px));
  return residual.text();
}

double number_after(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name);
  EXPECT_NE(at, std::string::npos) << text;
  return std::stod(text.substr(at + name.size()));
}

TEST(TrackingResidual, IsTheDistanceFromTheMotionThatThePosesSay) {
  for (const double said_px : {3.0, 0.0, 1.0}) {
    const std::string text = measured(said_px);
    EXPECT_NEAR(number_after(text, "true motion, px"), 3 - said_px, 0.05) << text;
    EXPECT_LT(number_after(text, "best motion, px"), 0.05) << text;
  }
}

TEST(TrackingResidual, LeavesOutTracksThatDoNotReturn) {
  // Something new covers more than half of the second image.
  const std::string text = measured(3, cv::Rect(0, 0, 190, 240));
  EXPECT_LT(number_after(text, "true motion, px"), 0.1) << text;
}

TEST(TrackingResidual, LeavesOutPersonsAndWhatIsBesideThem) {
  // A person who covers more than half of both images, with the camera.
  Segmentation masks;
  masks.image_size = {320, 240};
  const cv::Rect place(0, 0, 200, 240);
  masks.instances = {Instance::from_box_mask(cv::Mat(place.size(), CV_8UC1, 255), place)};
  cv::Mat images[2], depths[2];
  FrameView first = wall(0, images[0], depths[0]), second = wall(3, images[1], depths[1]);
  images[0](place).copyTo(images[1](place));
  const auto median_px = [&](const Segmentation& known) {
    TrackingResidual residual(camera());
    residual.add(first, known, grid(), moved(0));
    residual.add(second, known, grid(), moved(3));
    return number_after(residual.text(), "true motion, px");
  };
  EXPECT_GT(median_px({}), 2);
  EXPECT_LT(median_px(masks), 0.1);
}

TEST(TrackingResidual, SaysNothingOfAFewTracks) {
  const std::string text = measured(3, cv::Rect(0, 0, 300, 240));
  EXPECT_NE(text.find("true motion, px          -\n"), std::string::npos) << text;
}

TEST(TrackingResidual, SaysNothingWithoutTwoFrames) {
  const std::string text = TrackingResidual(camera()).text();
  EXPECT_NE(text.find("true motion, px          -\n"), std::string::npos) << text;
  EXPECT_NE(text.find("best motion, px          -\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace dynfilter::tools
