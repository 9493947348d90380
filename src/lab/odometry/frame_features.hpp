// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <dynfilter/frame.hpp>
#include <opencv2/core.hpp>

#include "pose_estimation.hpp"

namespace odometry {

using Descriptor = std::array<std::uint64_t, 4>;

/// Counts the bits that differ, 0 to 256.
int hamming_distance(const Descriptor& a, const Descriptor& b);

struct Feature {
  Observation observation;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< in the camera's frame, if depth is known
  Descriptor descriptor{};
  int octave = 0;
  float angle_deg = 0;
};

/// The features of one frame that the odometry uses, searchable by position.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  FeatureGrid(std::vector<Feature> features, const DisparityCamera& camera);

  std::size_t size() const { return features_.size(); }
  const Feature& operator[](std::size_t i) const { return features_[i]; }

  /// Appends the features in a square of 2 x `radius_px` around a pixel, in a fixed order.
  void find(const Eigen::Vector2d& pixel, double radius_px, std::vector<std::size_t>& found) const;

 private:
  std::size_t column_of(double x) const;
  std::size_t row_of(double y) const;

  std::vector<Feature> features_;
  std::size_t columns_ = 0, rows_ = 0;
  // Features beyond the image go into the outer cells.
  std::vector<std::vector<std::size_t>> cells_;
};

/// The accuracy of measured depth.
struct DepthNoise {
  double max_depth_m;         ///< anything farther counts as not measured
  double disparity_sigma_px;  ///< see DisparityCamera
};

/// Makes the features: reads depth at the raw pixel, then removes the distortion from the position.
FeatureGrid make_features(const dynfilter::FrameView& frame,
                          const std::vector<cv::KeyPoint>& keypoints, const cv::Mat& descriptors,
                          const dynfilter::Camera& lens, const DepthNoise& noise);

}  // namespace odometry
