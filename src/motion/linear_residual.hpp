// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Residuals around a pose, and the small motion that makes them least.

#pragma once

#include <opencv2/core.hpp>

#include "dynfilter/detail/rotation.hpp"
#include "dynfilter/motion/relative_pose.hpp"

namespace dynfilter::detail {

constexpr double tukey_cutoff = 3.5;        // residual without weight, in scales
constexpr double min_scale_px = 0.25;       // of the residuals
constexpr double median_to_scale = 1.4826;  // of normal errors
constexpr double far_away_px = 1e6;         // residual of what is behind the camera

using Twist = cv::Vec6d;  // rotation vector, then translation, in the earlier camera's frame

/// What the camera may do between the frames.
enum class Freedom { moves_and_turns, turns };

/// Residual in pixels, linear in a small motion: (x, y) - (along_x, along_y) * motion.
struct LinearResidual {
  double x = 0, y = 0;
  cv::Vec6d along_x, along_y;  // derivatives

  double squared() const { return x * x + y * y; }

  double squared_after(const Twist& motion) const {
    double left_x = x, left_y = y;
    for (int a = 0; a < 6; ++a) {
      left_x -= along_x[a] * motion[a];
      left_y -= along_y[a] * motion[a];
    }
    return left_x * left_x + left_y * left_y;
  }
};

/// Returns the residual of an observation around a pose.
inline LinearResidual linearised(const PoseObservation& observation, const Pose& pose,
                                 const Camera& camera, Freedom freedom) {
  const cv::Point3d p = pose * observation.point_now_m;
  if (!(p.z > 0)) return {far_away_px, far_away_px, {}, {}};  // fits no pose near this one
  const double iz = 1 / p.z, x = p.x * iz, y = p.y * iz;
  const cv::Point2d place(camera.fx * x + camera.cx, camera.fy * y + camera.cy);
  const cv::Point2d left = observation.pixel_then - place;
  const double fx = camera.fx, fy = camera.fy;
  // Where the camera only turns, a translation changes nothing.
  const double fxz = freedom == Freedom::turns ? 0 : fx * iz;
  const double fyz = freedom == Freedom::turns ? 0 : fy * iz;
  return {left.x,
          left.y,
          {-fx * x * y, fx * (1 + x * x), -fx * y, fxz, 0, -fxz * x},
          {-fy * (1 + y * y), fy * x * y, fy * x, 0, fyz, -fyz * y}};
}

/// Tukey's weight of a squared residual: 0 from the limit on.
inline double tukey_weight(double squared, double limit_px) {
  const double share = squared / (limit_px * limit_px);
  return share < 1 ? (1 - share) * (1 - share) : 0;
}

/// Normal equations of weighted linear residuals.
struct NormalEquations {
  cv::Matx66d matrix = cv::Matx66d::zeros();
  Twist right = Twist::all(0);

  void add(const LinearResidual& linear, double weight) {
    if (!(weight > 0)) return;
    for (int a = 0; a < 6; ++a) {
      const double first = weight * linear.along_x[a], second = weight * linear.along_y[a];
      for (int b = a; b < 6; ++b) {
        matrix(a, b) += first * linear.along_x[b] + second * linear.along_y[b];
      }
      right[a] += first * linear.x + second * linear.y;
    }
  }

  /// Returns the motion; damped a little, so that observations in a row give no huge one.
  Twist solved() {
    double trace = 0;
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < a; ++b) matrix(a, b) = matrix(b, a);
      trace += matrix(a, a);
    }
    for (int a = 0; a < 6; ++a) matrix(a, a) += 1e-12 * trace + 1e-12;
    return matrix.solve(right, cv::DECOMP_CHOLESKY);
  }
};

/// Returns a pose after a small motion.
inline Pose moved(const Pose& pose, const Twist& motion) {
  const cv::Matx33d turn = rotation_of({motion[0], motion[1], motion[2]});
  return {orthonormal(turn * pose.rotation),
          turn * pose.translation + cv::Vec3d(motion[3], motion[4], motion[5])};
}

}  // namespace dynfilter::detail
