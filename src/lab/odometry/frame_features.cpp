// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "frame_features.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstring>
#include <utility>

#include <dynfilter/features.hpp>

#include "orb_extractor.hpp"

namespace odometry {
namespace {

constexpr double cell_px = 20;

}  // namespace

int hamming_distance(const Descriptor& a, const Descriptor& b) {
  std::size_t distance = 0;
  for (std::size_t i = 0; i < a.size(); ++i) distance += std::bitset<64>(a[i] ^ b[i]).count();
  return static_cast<int>(distance);
}

FeatureGrid::FeatureGrid(std::vector<Feature> features, const DisparityCamera& camera)
    : features_(std::move(features)),
      columns_(static_cast<std::size_t>(camera.image_size.width / cell_px) + 1),
      rows_(static_cast<std::size_t>(camera.image_size.height / cell_px) + 1),
      cells_(columns_ * rows_) {
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const Eigen::Vector2d& pixel = features_[i].observation.pixel;
    cells_[row_of(pixel.y()) * columns_ + column_of(pixel.x())].push_back(i);
  }
}

std::size_t FeatureGrid::column_of(double x) const {
  return static_cast<std::size_t>(std::clamp(x / cell_px, 0.0, static_cast<double>(columns_ - 1)));
}

std::size_t FeatureGrid::row_of(double y) const {
  return static_cast<std::size_t>(std::clamp(y / cell_px, 0.0, static_cast<double>(rows_ - 1)));
}

void FeatureGrid::find(const Eigen::Vector2d& pixel, double radius_px,
                       std::vector<std::size_t>& found) const {
  if (cells_.empty()) return;
  const std::size_t last_row = row_of(pixel.y() + radius_px);
  const std::size_t last_column = column_of(pixel.x() + radius_px);
  for (std::size_t row = row_of(pixel.y() - radius_px); row <= last_row; ++row) {
    for (std::size_t column = column_of(pixel.x() - radius_px); column <= last_column; ++column) {
      for (const std::size_t i : cells_[row * columns_ + column]) {
        const Eigen::Vector2d offset = features_[i].observation.pixel - pixel;
        if (offset.cwiseAbs().maxCoeff() <= radius_px) found.push_back(i);
      }
    }
  }
}

FeatureGrid make_features(const dynfilter::FrameView& frame,
                          const std::vector<cv::KeyPoint>& keypoints, const cv::Mat& descriptors,
                          const dynfilter::Camera& lens, const DepthNoise& noise) {
  const DisparityCamera camera{lens, frame.image.size()};
  std::vector<Feature> features(keypoints.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    Feature& feature = features[i];
    feature.octave = keypoints[i].octave;
    feature.angle_deg = keypoints[i].angle;
    std::memcpy(feature.descriptor.data(), descriptors.ptr(static_cast<int>(i)),
                sizeof(Descriptor));
    Observation& observation = feature.observation;
    const auto ideal = lens.undistort(keypoints[i].pt);
    // Without an ideal pixel, the feature lies where nothing is searched, and has no depth.
    observation.pixel = ideal ? Eigen::Vector2d(ideal->x, ideal->y) : Eigen::Vector2d(-1e6, -1e6);
    const double depth_m = frame.depth_m(dynfilter::nearest_pixel(keypoints[i].pt)).value_or(0.0);
    observation.depth_m = ideal && depth_m <= noise.max_depth_m ? depth_m : 0.0;
    observation.sigma_px = octave_scale(feature.octave);
    observation.disparity_sigma_px = noise.disparity_sigma_px;
    feature.point = camera.back_project(observation.pixel, observation.depth_m);
  }
  return {std::move(features), camera};
}

}  // namespace odometry
