// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_residual.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

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

/// Returns the least and the largest depth in a window, in units of the image; an empty range if
/// there is none.
template <class Depth>
std::pair<float, float> extremes(const cv::Mat& depth, const cv::Rect& window) {
  float least = std::numeric_limits<float>::infinity(), most = 0;
  for (int y = window.y; y < window.y + window.height; ++y) {
    const Depth* const row = depth.ptr<Depth>(y);
    for (int x = window.x; x < window.x + window.width; ++x) {
      const auto value = static_cast<float>(row[x]);
      if (!(value > 0) || std::isinf(value)) continue;
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  return {least, most};
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
  const cv::Rect window =
      cv::Rect(pixel.x - reach, pixel.y - reach, options.window_px, options.window_px) & image;
  const bool is_integer = frame.depth.type() == CV_16UC1;
  const auto [least, most] = is_integer ? extremes<std::uint16_t>(frame.depth, window)
                                        : extremes<float>(frame.depth, window);
  if (!(least <= most)) return interval;
  const double nearest = double{least} * frame.depth_scale();
  const double farthest = double{most} * frame.depth_scale();
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

double depth_residual_m(const RelativePose& then_from_now, const cv::Point3d& now_m,
                        const DepthInterval& now, const DepthInterval& then) {
  if (!now.is_known() || !then.is_known()) return 0;
  const auto static_depth_m = [&](double depth_now_m) {
    return (then_from_now * (now_m * (depth_now_m / now_m.z))).z;
  };
  const double nearer_m = then.nearest_m - static_depth_m(now.farthest_m);
  const double farther_m = static_depth_m(now.nearest_m) - then.farthest_m;
  return nearer_m > 0 ? nearer_m : -std::max(farther_m, 0.0);
}

}  // namespace dynfilter
