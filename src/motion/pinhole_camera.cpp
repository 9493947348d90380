// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/pinhole_camera.hpp"

#include <cmath>
#include <utility>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {
namespace {

constexpr int iterations = 10;

bool has_distortion(const PinholeCamera& camera) {
  return camera.k1 != 0 || camera.k2 != 0 || camera.p1 != 0 || camera.p2 != 0 || camera.k3 != 0;
}

/// Effect of the lens on a point of the plane at distance 1: distorted = factor * point + shift.
struct Distortion {
  double factor;
  cv::Point2d shift;
};

Distortion distortion_at(const PinholeCamera& camera, cv::Point2d point) {
  const double r2 = point.dot(point);
  const double xy = point.x * point.y;
  return {1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3)),
          {2 * camera.p1 * xy + camera.p2 * (r2 + 2 * point.x * point.x),
           camera.p1 * (r2 + 2 * point.y * point.y) + 2 * camera.p2 * xy}};
}

}  // namespace

cv::Point2d PinholeCamera::ideal(cv::Point2f raw) const {
  if (!has_distortion(*this)) return raw;
  const cv::Point2d distorted((raw.x - cx) / fx, (raw.y - cy) / fy);
  cv::Point2d point = distorted;
  for (int i = 0; i < iterations; ++i) {
    const Distortion distortion = distortion_at(*this, point);
    point = (distorted - distortion.shift) / distortion.factor;
  }
  return {fx * point.x + cx, fy * point.y + cy};
}

cv::Point2d PinholeCamera::raw(cv::Point2d ideal) const {
  if (!has_distortion(*this)) return ideal;
  const cv::Point2d point((ideal.x - cx) / fx, (ideal.y - cy) / fy);
  const Distortion distortion = distortion_at(*this, point);
  const cv::Point2d distorted = distortion.factor * point + distortion.shift;
  return {fx * distorted.x + cx, fy * distorted.y + cy};
}

void validate(const PinholeCamera& camera, const char* component) {
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

}  // namespace dynfilter
