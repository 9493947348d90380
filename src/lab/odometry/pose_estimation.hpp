// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <dynfilter/camera.hpp>
#include <dynfilter/pose.hpp>
#include <opencv2/core.hpp>

namespace odometry {

/// The world in the camera's frame: point_camera = pose * point_world.
using dynfilter::Pose;

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

inline Eigen::Map<const RowMajor> rotation_of(const Pose& pose) {
  return Eigen::Map<const RowMajor>(pose.rotation.val);
}

inline Eigen::Vector3d operator*(const Pose& pose, const Eigen::Vector3d& point) {
  return rotation_of(pose) * point + Eigen::Map<const Eigen::Vector3d>(pose.translation.val);
}

/// Returns the camera's centre in the world.
inline Eigen::Vector3d centre_of(const Pose& pose) {
  return Eigen::Vector3d(pose.inverse().translation.val);
}

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
  const Eigen::Quaterniond rotation = turn * Eigen::Quaterniond(RowMajor(rotation_of(pose)));
  Pose result;
  Eigen::Map<RowMajor>(result.rotation.val) = rotation.normalized().toRotationMatrix();
  Eigen::Map<Eigen::Vector3d>(result.translation.val) =
      turn * Eigen::Vector3d(pose.translation.val) + Eigen::Vector3d(step.tail<3>());
  return result;
}

/// A camera whose depth counts as the disparity of a stereo pair, for ideal pixels. A
/// structured-light camera measures that way, so its noise is about equal at every distance.
struct DisparityCamera : dynfilter::Camera {
  cv::Size image_size;
  double baseline_m = 0.08;  ///< between a Kinect's projector and its camera

  double disparity_px(double depth_m) const { return fx * baseline_m / depth_m; }

  /// Projects a point of the camera's frame to (u, v, disparity); its z must not be 0.
  Eigen::Vector3d project(const Eigen::Vector3d& point) const {
    return {fx * point.x() / point.z() + cx, fy * point.y() / point.z() + cy,
            disparity_px(point.z())};
  }

  Eigen::Vector3d back_project(const Eigen::Vector2d& pixel, double depth_m) const {
    return {(pixel.x() - cx) / fx * depth_m, (pixel.y() - cy) / fy * depth_m, depth_m};
  }
};

/// A frame's measurement of a point.
struct Observation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< without distortion
  double depth_m = 0;                               ///< 0 = not measured
  double sigma_px = 1;                              ///< of the position; grows with the octave
  double disparity_sigma_px = 1;
};

/// Returns the 95 % quantile of the chi-square distribution; an observation beyond it is an
/// outlier.
inline double chi2_limit(const Observation& observation) {
  return observation.depth_m > 0 ? 7.815 : 5.991;
}

/// Returns (u, v, disparity) predicted minus measured, in standard deviations; the last is 0
/// without depth.
inline Eigen::Vector3d residual(const DisparityCamera& camera, const Observation& observation,
                                const Eigen::Vector3d& point_camera) {
  const Eigen::Vector3d predicted = camera.project(point_camera);
  Eigen::Vector3d result;
  result.head<2>() = (predicted.head<2>() - observation.pixel) / observation.sigma_px;
  result.z() = 0;
  if (observation.depth_m > 0) {
    result.z() =
        (predicted.z() - camera.disparity_px(observation.depth_m)) / observation.disparity_sigma_px;
  }
  return result;
}

/// Returns the derivative of the residual with respect to the point in the camera's frame.
inline Eigen::Matrix3d point_jacobian(const DisparityCamera& camera, const Observation& observation,
                                      const Eigen::Vector3d& point_camera) {
  const double z = point_camera.z();
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
  jacobian(0, 0) = camera.fx / z / observation.sigma_px;
  jacobian(0, 2) = -camera.fx * point_camera.x() / (z * z) / observation.sigma_px;
  jacobian(1, 1) = camera.fy / z / observation.sigma_px;
  jacobian(1, 2) = -camera.fy * point_camera.y() / (z * z) / observation.sigma_px;
  if (observation.depth_m > 0) {
    jacobian(2, 2) = -camera.fx * camera.baseline_m / (z * z) / observation.disparity_sigma_px;
  }
  return jacobian;
}

/// Returns the derivative of the residual with respect to the step of `moved`, given that with
/// respect to the point.
inline Eigen::Matrix<double, 3, 6> pose_jacobian(const Eigen::Matrix3d& by_point,
                                                 const Eigen::Vector3d& point_camera) {
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>() = -by_point * cross_product_matrix(point_camera);
  jacobian.rightCols<3>() = by_point;
  return jacobian;
}

/// Huber's kernel on a squared residual: the cost, and the weight in the normal equations.
struct RobustCost {
  double cost = 0;
  double weight = 1;
};

inline RobustCost huber(double squared, double limit) {
  if (squared <= limit) return {squared, 1};
  const double ratio = std::sqrt(limit / squared);
  return {2 * ratio * squared - limit, ratio};
}

/// A map point and where the frame sees it.
struct PointMatch {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< in the world
  Observation observation;
  bool is_inlier = true;
};

/// Moves the pose to the best agreement with the matches, by Levenberg-Marquardt in four passes,
/// and marks the matches that disagree. Every pass considers every match again; Huber's kernel
/// damps the residuals in the first two. Starts from `pose` and does not search: a moving person
/// with a third of the matches pulls the pose along. Returns the number of inliers; with fewer than
/// three matches the pose does not change.
std::size_t refine_pose(const DisparityCamera& camera, Pose& pose,
                        std::vector<PointMatch>& matches);

/// Estimates the pose that most matches agree with, from random samples of four (P3P, and a fourth
/// point to choose the solution). Marks the inliers. Returns std::nullopt if fewer than
/// `min_inliers` agree. The samples depend on the seed alone.
std::optional<Pose> pnp_ransac(const DisparityCamera& camera, std::vector<PointMatch>& matches,
                               std::size_t min_inliers, std::uint64_t seed);

}  // namespace odometry
