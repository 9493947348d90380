// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/odometry/frame_features.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "lab/odometry/orb_extractor.hpp"

namespace odometry {
namespace {

TEST(FrameFeatures, FindsTheFeaturesOfASquare) {
  cv::RNG random(3);
  PinholeCamera camera;
  camera.width = 130;
  camera.height = 100;
  std::vector<Feature> features(400);
  for (Feature& feature : features) {  // some beyond the image
    feature.observation.pixel = {random.uniform(-20.0, 150.0), random.uniform(-20.0, 120.0)};
  }
  for (std::size_t i = 0; i < 20; ++i) {  // at whole pixels
    features[i].observation.pixel = features[i].observation.pixel.array().round();
  }
  const FrameFeatures grid(features, camera);
  std::size_t found_in_all = 0;
  for (int trial = 0; trial < 500; ++trial) {
    Eigen::Vector2d pixel(random.uniform(-30.0, 160.0), random.uniform(-30.0, 130.0));
    double radius_px = random.uniform(0.5, 40.0);
    if (trial % 5 == 0) {  // a feature lies exactly on the side
      radius_px = std::ceil(radius_px);
      pixel = features[static_cast<std::size_t>(trial % 20)].observation.pixel.array() + radius_px;
    }
    std::vector<std::size_t> found, expected;
    grid.find(pixel, radius_px, found);
    std::sort(found.begin(), found.end());
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Eigen::Vector2d away = features[i].observation.pixel - pixel;
      if (std::abs(away.x()) <= radius_px && std::abs(away.y()) <= radius_px) expected.push_back(i);
    }
    ASSERT_EQ(found, expected) << trial;
    found_in_all += found.size();
  }
  EXPECT_GT(found_in_all, 1000U);
}

TEST(MakeFeatures, RemovesTheDistortionOfEachCoefficient) {
  using Parameters = dynfilter::CameraParameters;
  dynfilter::FrameView frame;
  frame.image = cv::Mat(480, 640, CV_8UC1);
  const std::vector<cv::KeyPoint> keypoints = {{500, 400, 7}};
  const cv::Mat descriptors(1, 32, CV_8UC1, cv::Scalar(0));
  const auto pixel_with = [&](double Parameters::*coefficient, double value) {
    Parameters parameters;
    parameters.fx = parameters.fy = 500;
    parameters.cx = 320;
    parameters.cy = 240;
    parameters.*coefficient = value;
    return make_features(frame, keypoints, descriptors, parameters, {10, 1})[0].observation.pixel;
  };
  EXPECT_EQ(pixel_with(&Parameters::k1, 0), Eigen::Vector2d(500, 400));
  for (double Parameters::*const coefficient :
       {&Parameters::k1, &Parameters::k2, &Parameters::p1, &Parameters::p2, &Parameters::k3}) {
    EXPECT_GT((pixel_with(coefficient, 0.1) - Eigen::Vector2d(500, 400)).norm(), 0.1);
  }
}

TEST(OctaveScale, IsThatOfTheNearestOctave) {
  EXPECT_EQ(octave_scale(-1), 1);
  EXPECT_EQ(octave_scale(0), 1);
  EXPECT_GT(octave_scale(octaves - 1), octave_scale(octaves - 2));
  EXPECT_EQ(octave_scale(octaves), octave_scale(octaves - 1));
}

TEST(Huber, IsQuadraticUpToTheLimitAndLinearBeyond) {
  constexpr double limit = 6;
  for (const double squared : {0.0, 0.5, 3.0, 6.0}) {
    EXPECT_EQ(huber(squared, limit).cost, squared);
    EXPECT_EQ(huber(squared, limit).weight, 1);
  }
  // Linear in the residual: 2 * sqrt(limit) * residual - limit.
  EXPECT_NEAR(huber(24, limit).cost, 2 * std::sqrt(limit) * std::sqrt(24) - limit, 1e-12);
  EXPECT_NEAR(huber(24, limit).weight, 0.5, 1e-12);
}

TEST(Huber, WeighsByTheDerivativeOfTheCost) {
  for (double squared = 0.5; squared < 40; squared += 0.7) {
    const double step = 1e-6;
    const double slope =
        (huber(squared + step, 6).cost - huber(squared - step, 6).cost) / (2 * step);
    EXPECT_NEAR(huber(squared, 6).weight, slope, 1e-6) << squared;
  }
}

}  // namespace
}  // namespace odometry
