// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <opencv2/core.hpp>

namespace dynfilter {

/// Rigid transform: the point p of one frame lies at rotation * p + translation in another.
struct Pose {
  cv::Matx33d rotation = cv::Matx33d::eye();  ///< orthonormal, determinant 1
  cv::Vec3d translation = {0, 0, 0};          ///< metres

  /// Returns a point of the one frame in the other.
  cv::Point3d operator*(const cv::Point3d& point) const {
    const cv::Vec3d moved = rotation * cv::Vec3d(point) + translation;
    return {moved[0], moved[1], moved[2]};
  }

  /// Returns the transform that applies the other one first.
  Pose operator*(const Pose& first) const {
    return {rotation * first.rotation, rotation * first.translation + translation};
  }

  /// Returns the transform back.
  Pose inverse() const { return {rotation.t(), -(rotation.t() * translation)}; }
};

}  // namespace dynfilter
