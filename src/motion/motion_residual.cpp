// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_residual.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {
namespace {

// A point nearer than this share of the farther end's depth does not bound the segment usefully.
constexpr double min_depth_share = 1e-6;

void check(const DepthIntervalOptions& options) {
  if (options.window_px < 1 || options.window_px > 99 || options.window_px % 2 == 0) {
    detail::throw_misuse("depth_interval", detail::concatenate("window_px = ", options.window_px),
                         "an odd number from 1 to 99");
  }
  if (!(options.noise_at_1m_m >= 0 && options.noise_factor >= 0 && options.min_depth_m > 0)) {
    detail::throw_misuse("depth_interval",
                         detail::concatenate("noise_at_1m_m = ", options.noise_at_1m_m,
                                             ", noise_factor = ", options.noise_factor,
                                             ", min_depth_m = ", options.min_depth_m),
                         "noise of at least 0 and a depth above 0");
  }
}

/// Place in the earlier frame of a point on the ray, up to scale: `inverse_depth` times the place
/// of the point at that inverse depth. Finite at infinity.
cv::Vec3d scaled_place(const cv::Vec3d& turned_ray, const cv::Vec3d& translation,
                       double inverse_depth) {
  return turned_ray + translation * inverse_depth;
}

}  // namespace

DepthInterval depth_interval(const FrameView& frame, cv::Point pixel,
                             const DepthIntervalOptions& options) {
  check(options);
  DepthInterval interval{options.min_depth_m, std::numeric_limits<double>::infinity()};
  const cv::Rect image({}, frame.depth.size());
  if (!image.contains(pixel)) return interval;
  const int reach = options.window_px / 2;
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
  for (int y = pixel.y - reach; y <= pixel.y + reach; ++y) {
    for (int x = pixel.x - reach; x <= pixel.x + reach; ++x) {
      const std::optional<double> depth_m = frame.depth_m({x, y});
      if (!depth_m) continue;
      nearest = std::min(nearest, *depth_m);
      farthest = std::max(farthest, *depth_m);
    }
  }
  if (farthest == 0) return interval;
  const double widening = options.noise_factor * options.noise_at_1m_m;
  // Not nearer than half the measured depth, however noisy the sensor.
  return {std::max(nearest - widening * nearest * nearest, 0.5 * nearest),
          farthest + widening * farthest * farthest};
}

std::optional<MotionResidual> motion_residual(const PinholeCamera& camera,
                                              const RelativePose& then_from_now, cv::Point2d now,
                                              cv::Point2d then, const DepthInterval& depth) {
  const cv::Point3d ray = camera.point(now, 1);
  const cv::Vec3d turned = then_from_now.rotation * cv::Vec3d(ray);
  const cv::Vec3d& translation = then_from_now.translation;
  // The depth then, over the depth now, is linear in the inverse depth now: cut off what is behind.
  double low = 1 / depth.farthest_m, high = 1 / depth.nearest_m;
  const double slope = translation[2];
  const double limit = (min_depth_share - turned[2]) / slope;
  if (slope < 0) high = std::min(high, limit);
  if (slope > 0) low = std::max(low, limit);
  if (slope == 0 && !(turned[2] > 0)) return {};
  if (!(low <= high)) return {};
  const auto place = [&](double inverse_depth) {
    const cv::Vec3d p = scaled_place(turned, translation, inverse_depth);
    return cv::Point2d(camera.fx * p[0] / p[2] + camera.cx, camera.fy * p[1] / p[2] + camera.cy);
  };
  const cv::Point2d first = place(low), last = place(high);
  const cv::Point2d along = last - first;
  const double length2 = along.dot(along);
  const double share =
      length2 > 0 ? std::clamp((then - first).dot(along) / length2, 0.0, 1.0) : 0.0;
  const cv::Point2d nearest = first + share * along;
  return MotionResidual{cv::norm(then - nearest), nearest};
}

}  // namespace dynfilter
