// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_ODOMETRY_POSE_HPP
#define DYNFILTER_SRC_LAB_ODOMETRY_POSE_HPP

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace odometry {

/// The world in the camera's frame: point_camera = rotation * point_world + translation.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }

  Pose operator*(const Pose& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }

  Pose inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }

  /// Returns the camera's centre in the world.
  Eigen::Vector3d centre() const { return -(rotation.transpose() * translation); }
};

/// A small motion of the camera: a rotation vector (rad), then a translation (m).
using Twist = Eigen::Matrix<double, 6, 1>;

inline Eigen::Matrix3d cross_product_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

/// Returns the pose after a small motion in the camera's own frame. Rotation and translation are
/// updated separately, which has the derivative of the exponential map at 0. The rotation is
/// orthonormalised, so that errors do not add up over thousands of updates.
inline Pose moved(const Pose& pose, const Twist& step) {
  const Eigen::Vector3d axis = step.head<3>();
  const double angle = axis.norm();
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  if (angle > 0) turn = Eigen::AngleAxisd(angle, axis / angle);
  const Eigen::Quaterniond rotation = turn * Eigen::Quaterniond(pose.rotation);
  return {rotation.normalized().toRotationMatrix(),
          turn * pose.translation + Eigen::Vector3d(step.tail<3>())};
}

}  // namespace odometry

#endif  // DYNFILTER_SRC_LAB_ODOMETRY_POSE_HPP
