// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rotations as matrices, rotation vectors and quaternions.

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Tells whether a matrix is a rotation to 1e-3, which hosts that compute in float reach.
inline bool is_rotation(const cv::Matx33d& matrix) {
  return cv::norm(matrix.t() * matrix - cv::Matx33d::eye()) < 1e-3 && cv::determinant(matrix) > 0;
}

/// Returns the rotation by a rotation vector (Rodrigues).
inline cv::Matx33d rotation_of(const cv::Vec3d& vector) {
  const double angle = cv::norm(vector);
  if (!(angle > 0)) return cv::Matx33d::eye();
  const cv::Vec3d axis = vector / angle;
  const double c = std::cos(angle), s = std::sin(angle);
  const cv::Matx33d cross(0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0);
  return cv::Matx33d::eye() * c + cross * s + (axis * axis.t()) * (1 - c);
}

/// Returns the rotation of a quaternion x y z w of length 1.
inline cv::Matx33d rotation_of_quaternion(const cv::Vec4d& q) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
}

/// Returns the axis of a rotation, times twice the sine of its angle.
inline cv::Vec3d twice_sine_axis_of(const cv::Matx33d& rotation) {
  return {rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
          rotation(1, 0) - rotation(0, 1)};
}

/// Returns the angle of a rotation, 0 to pi.
inline double angle_of(const cv::Matx33d& rotation) {
  return std::atan2(cv::norm(twice_sine_axis_of(rotation)) / 2, (cv::trace(rotation) - 1) / 2);
}

/// Returns the rotation vector of a rotation by less than half a turn.
inline cv::Vec3d rotation_vector_of(const cv::Matx33d& rotation) {
  const cv::Vec3d twice_sine_axis = twice_sine_axis_of(rotation);
  const double sine = cv::norm(twice_sine_axis) / 2;
  if (!(sine > 0)) return {};
  return twice_sine_axis * (angle_of(rotation) / (2 * sine));
}

/// Returns x y z w of a rotation, with w >= 0, which picks one of the two signs. The first
/// component computed is one that is not near zero, because the others are divided by it.
/// (Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985.)
inline cv::Vec4d quaternion_of(const cv::Matx33d& rotation) {
  cv::Vec4d quaternion;
  const double trace = cv::trace(rotation);
  if (trace > 0) {
    const double root = std::sqrt(trace + 1);
    const cv::Vec3d axis = twice_sine_axis_of(rotation);
    quaternion = cv::Vec4d(axis[0], axis[1], axis[2], root * root) * (0.5 / root);
  } else {
    int i = rotation(1, 1) > rotation(0, 0) ? 1 : 0;
    if (rotation(2, 2) > rotation(i, i)) i = 2;
    const int j = (i + 1) % 3;
    const int k = (j + 1) % 3;
    const double root = std::sqrt(rotation(i, i) - rotation(j, j) - rotation(k, k) + 1);
    quaternion[i] = root * root;
    quaternion[j] = rotation(j, i) + rotation(i, j);
    quaternion[k] = rotation(k, i) + rotation(i, k);
    quaternion[3] = rotation(k, j) - rotation(j, k);
    quaternion *= 0.5 / root;
  }
  quaternion *= 1 / cv::norm(quaternion);
  return quaternion[3] < 0 ? -quaternion : quaternion;
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
