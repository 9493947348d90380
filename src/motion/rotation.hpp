// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rotations of a pose.

#pragma once

#include <cmath>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Returns the rotation by a rotation vector (Rodrigues).
inline cv::Matx33d rotation_of(const cv::Vec3d& vector) {
  const double angle = cv::norm(vector);
  if (!(angle > 0)) return cv::Matx33d::eye();
  const cv::Vec3d axis = vector / angle;
  const double c = std::cos(angle), s = std::sin(angle);
  const cv::Matx33d cross(0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0);
  return cv::Matx33d::eye() * c + cross * s + (axis * axis.t()) * (1 - c);
}

/// Returns the rotation vector of a rotation by less than half a turn: the inverse of rotation_of.
inline cv::Vec3d rotation_vector_of(const cv::Matx33d& rotation) {
  const cv::Vec3d twice_sine_axis(rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                                  rotation(1, 0) - rotation(0, 1));
  const double sine = cv::norm(twice_sine_axis) / 2;
  if (!(sine > 0)) return {};
  return twice_sine_axis * (std::atan2(sine, (cv::trace(rotation) - 1) / 2) / (2 * sine));
}

/// Makes the rows orthonormal, so that errors do not add up over thousands of motions.
inline cv::Matx33d orthonormal(const cv::Matx33d& rotation) {
  cv::Vec3d x(rotation(0, 0), rotation(0, 1), rotation(0, 2));
  cv::Vec3d y(rotation(1, 0), rotation(1, 1), rotation(1, 2));
  x = cv::normalize(x);
  y = cv::normalize(y - x * x.dot(y));
  const cv::Vec3d z = x.cross(y);
  return {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
}

}  // namespace dynfilter::detail
