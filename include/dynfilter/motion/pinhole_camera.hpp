// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_PINHOLE_CAMERA_HPP
#define DYNFILTER_MOTION_PINHOLE_CAMERA_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <optional>

#include <opencv2/core.hpp>

namespace dynfilter {

/// Pinhole camera with OpenCV's radial-tangential distortion, for components that relate pixels to
/// rays. An ideal pixel is where the feature would be without distortion, with the same focal
/// lengths and principal point; without distortion, it is the pixel itself.
struct PinholeCamera {
  double fx = 0;  ///< focal length in x, pixels; above 0
  double fy = 0;  ///< focal length in y, pixels; above 0
  double cx = 0;  ///< principal point's x, pixels
  double cy = 0;  ///< principal point's y, pixels
  /// @{
  /// Distortion coefficient; all 0 = rectified images.
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  /// @}

  /// Returns the ideal pixel of a raw one, to about 1e-3 px for lenses without strong distortion
  /// (ten fixed-point iterations). O(1).
  cv::Point2d ideal(cv::Point2f raw) const;

  /// Returns the raw pixel of an ideal one. O(1).
  cv::Point2d raw(cv::Point2d ideal) const;

  /// Returns the point at this depth (metres along the optical axis) behind an ideal pixel, in the
  /// camera's frame, metres. O(1).
  cv::Point3d point(cv::Point2d ideal, double depth_m) const {
    return {(ideal.x - cx) / fx * depth_m, (ideal.y - cy) / fy * depth_m, depth_m};
  }

  /// Returns the ideal pixel of a point of the camera's frame; none for a point that is not in
  /// front of the camera. O(1).
  std::optional<cv::Point2d> project(const cv::Point3d& point) const {
    if (!(point.z > 0)) return {};
    return cv::Point2d(fx * point.x / point.z + cx, fy * point.y / point.z + cy);
  }
};

/// Checks a camera. Throws std::invalid_argument, in the name of `component`, unless all numbers
/// are finite and the focal lengths above 0. O(1).
void validate(const PinholeCamera& camera, const char* component);

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_PINHOLE_CAMERA_HPP
