// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {

/// Pinhole camera with OpenCV's radial-tangential distortion, which relates pixels to rays. An
/// ideal pixel is where a feature would be without distortion, with the same focal lengths and
/// principal point. All functions are pure and O(1).
struct Camera {
  double fx = 0;  ///< focal length in x, pixels; above 0
  double fy = 0;  ///< focal length in y, pixels; above 0
  double cx = 0;  ///< principal point's x, pixels
  double cy = 0;  ///< principal point's y, pixels
  /// @{
  /// Distortion coefficient; all 0 = rectified images.
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  /// @}

  /// Whether raw and ideal pixels differ.
  bool has_distortion() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0; }

  /// Returns the ideal pixel of a raw one, whose raw pixel is the given one to 1e-6 px. Returns
  /// nothing for a pixel that no ray reaches: from some distance on, a wide lens's coefficients
  /// lead back towards the image's centre.
  std::optional<cv::Point2d> undistort(cv::Point2d raw) const;

  /// Returns the raw pixel of an ideal one; nothing beyond the distance at which the coefficients
  /// lead back.
  std::optional<cv::Point2d> distort(cv::Point2d ideal) const;

  /// Returns the point at this depth (metres along the optical axis) behind an ideal pixel, in the
  /// camera's frame, metres.
  cv::Point3d point(cv::Point2d ideal, double depth_m) const {
    return {(ideal.x - cx) / fx * depth_m, (ideal.y - cy) / fy * depth_m, depth_m};
  }

  /// Returns the ideal pixel of a point of the camera's frame; nothing for a point that is not in
  /// front of the camera.
  std::optional<cv::Point2d> project(const cv::Point3d& point) const {
    if (!(point.z > 0)) return {};
    return cv::Point2d(fx * point.x / point.z + cx, fy * point.y / point.z + cy);
  }
};

/// Checks a camera. Throws std::invalid_argument, in the name of `component`, unless all numbers
/// are finite and the focal lengths above 0. O(1).
inline void validate(const Camera& camera, const char* component) {
  const std::pair<const char*, double> numbers[] = {
      {"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}, {"k1", camera.k1},
      {"k2", camera.k2}, {"p1", camera.p1}, {"p2", camera.p2}, {"k3", camera.k3}};
  for (const auto& [name, number] : numbers) {
    if (std::isfinite(number)) continue;
    detail::throw_misuse(component, detail::concatenate("a camera with ", name, " = ", number),
                         "finite intrinsics");
  }
  if (!(camera.fx > 0 && camera.fy > 0)) {
    detail::throw_misuse(component, detail::concatenate("fx = ", camera.fx, ", fy = ", camera.fy),
                         "focal lengths above 0");
  }
}

namespace detail {

/// Where a lens moves a point of the plane at distance 1, and the derivatives by the point.
struct DistortedPoint {
  cv::Point2d place;
  double along_x, across, along_y;  // dx/dx, dx/dy = dy/dx, dy/dy

  double determinant() const { return along_x * along_y - across * across; }
};

/// Tells whether the radial distortion grows all the way from the centre to this squared distance:
/// whether its derivative 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 is above 0 up to s = r2.
inline bool is_before_fold(const Camera& camera, double r2) {
  const double a = 3 * camera.k1, b = 5 * camera.k2, c = 7 * camera.k3;
  const auto grows_at = [&](double s) { return 1 + s * (a + s * (b + s * c)) > 0; };
  const double square = b * b - 3 * a * c;
  if (!grows_at(r2) || !(square > 0)) return grows_at(r2);
  const double root = std::sqrt(square);  // the slope has its only minimum at the larger root
  const double least_at = b < 0 && c != 0 ? (root - b) / (3 * c) : -a / (b + root);
  return !(least_at > 0 && least_at < r2) || grows_at(least_at);
}

/// Returns what the lens does to a point; nothing beyond the fold.
inline std::optional<DistortedPoint> distorted(const Camera& camera, cv::Point2d point) {
  const double x = point.x, y = point.y, r2 = x * x + y * y, p1 = camera.p1, p2 = camera.p2;
  const double factor = 1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  const double slope = 2 * (camera.k1 + r2 * (2 * camera.k2 + r2 * 3 * camera.k3));
  const DistortedPoint result{{factor * x + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                               factor * y + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y},
                              factor + slope * x * x + 2 * p1 * y + 6 * p2 * x,
                              slope * x * y + 2 * (p1 * x + p2 * y),
                              factor + slope * y * y + 6 * p1 * y + 2 * p2 * x};
  if (!is_before_fold(camera, r2) || !(result.determinant() > 0)) return {};
  return result;
}

}  // namespace detail

inline std::optional<cv::Point2d> Camera::distort(cv::Point2d ideal) const {
  if (!has_distortion()) return ideal;
  const auto there = detail::distorted(*this, {(ideal.x - cx) / fx, (ideal.y - cy) / fy});
  if (!there) return {};
  return cv::Point2d(fx * there->place.x + cx, fy * there->place.y + cy);
}

// Newton's method from the centre. A step that leads beyond the fold or farther away is halved.
inline std::optional<cv::Point2d> Camera::undistort(cv::Point2d raw) const {
  if (!has_distortion()) return raw;
  constexpr int max_steps = 40;  // five do, but at a fold
  constexpr double accuracy_px = 1e-7;
  const cv::Point2d wanted((raw.x - cx) / fx, (raw.y - cy) / fy);
  cv::Point2d point, step = wanted;
  double least_px = cv::norm(raw - cv::Point2d(cx, cy));
  for (int i = 0; i < max_steps; ++i) {
    const cv::Point2d next = point + step;
    const auto there = detail::distorted(*this, next);
    const cv::Point2d left = there ? wanted - there->place : wanted;
    const double left_px = std::hypot(fx * left.x, fy * left.y);
    if (there && left_px <= accuracy_px) return cv::Point2d(fx * next.x + cx, fy * next.y + cy);
    if (!there || !(left_px < least_px)) {
      step *= 0.5;
      continue;
    }
    point = next;
    least_px = left_px;
    step = cv::Point2d(there->along_y * left.x - there->across * left.y,
                       there->along_x * left.y - there->across * left.x) /
           there->determinant();
  }
  return {};
}

}  // namespace dynfilter
