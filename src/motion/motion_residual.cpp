// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_residual.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace dynfilter::detail {
namespace {

// A point nearer than this share of the farther end's depth does not bound the segment usefully.
constexpr double min_depth_share = 1e-6;

/// Depth may be registered a few pixels off. A larger reach explains away what moves.
constexpr int window_reach_px = 4;
// Noise of a depth sensor, metres at 1 m, grows with the square of the depth. A larger one hides
// motion along the view.
constexpr double noise_at_1m_m = 0.0025, noise_factor = 2;
/// A gap of at least this in the window's depths is left out. A larger one hides what moves before
/// a wall.
constexpr double min_gap_m = 0.3;

/// Calls `action` for each depth in a window, in units of the image.
template <class Depth, class Action>
void for_each_depth(const cv::Mat& depth, const cv::Rect& window, const Action& action) {
  for (int y = window.y; y < window.y + window.height; ++y) {
    const Depth* const row = depth.ptr<Depth>(y);
    for (int x = window.x; x < window.x + window.width; ++x) {
      const auto value = static_cast<float>(row[x]);
      if (value > 0 && !std::isinf(value)) action(value);
    }
  }
}

/// Depths in a window, in units of the image.
struct WindowDepths {
  float least = std::numeric_limits<float>::infinity(), most = 0;  // an empty range: none
  float before_gap = 0, after_gap = 0;  // nearest to the middle, from either side
};

template <class Depth>
WindowDepths depths_in(const cv::Mat& image, const cv::Rect& window, float min_gap) {
  WindowDepths depths;
  for_each_depth<Depth>(image, window, [&](float value) {
    depths.least = std::min(depths.least, value);
    depths.most = std::max(depths.most, value);
  });
  if (!(depths.most - depths.least >= min_gap)) return depths;
  const float middle = depths.least + (depths.most - depths.least) / 2;
  depths.before_gap = depths.least;
  depths.after_gap = depths.most;
  for_each_depth<Depth>(image, window, [&](float value) {
    if (value <= middle) depths.before_gap = std::max(depths.before_gap, value);
    if (value > middle) depths.after_gap = std::min(depths.after_gap, value);
  });
  return depths;
}

/// One or two intervals without a gap.
struct DepthSides {
  std::array<DepthInterval, 2> intervals;
  std::size_t count;

  const DepthInterval* begin() const { return intervals.data(); }
  const DepthInterval* end() const { return intervals.data() + count; }
};

/// Returns what an interval holds on either side of its gap.
DepthSides sides_of(const DepthInterval& depth) {
  if (!depth.has_gap()) return {{depth, {}}, 1};
  return {{DepthInterval{depth.nearest_m, depth.gap_nearest_m},
           DepthInterval{depth.gap_farthest_m, depth.farthest_m}},
          2};
}

}  // namespace

DepthInterval depth_interval(const FrameView& frame, cv::Point pixel) {
  DepthInterval interval;
  const cv::Rect image({}, frame.depth.size());
  if (!image.contains(pixel)) return interval;
  const cv::Rect window = square_around(pixel, window_reach_px) & image;
  const double scale = frame.depth_scale();
  const auto min_gap = static_cast<float>(min_gap_m / scale);
  const WindowDepths depths = frame.depth.type() == CV_16UC1
                                  ? depths_in<std::uint16_t>(frame.depth, window, min_gap)
                                  : depths_in<float>(frame.depth, window, min_gap);
  if (!(depths.least <= depths.most)) return interval;
  // Not nearer than half the measured depth, however noisy the sensor.
  const auto noise_m = [&](double depth_m) {
    return noise_factor * noise_at_1m_m * depth_m * depth_m;
  };
  const auto nearer = [&](float depth) {
    const double depth_m = double{depth} * scale;
    return std::max(depth_m - noise_m(depth_m), 0.5 * depth_m);
  };
  const auto farther = [&](float depth) {
    const double depth_m = double{depth} * scale;
    return depth_m + noise_m(depth_m);
  };
  interval.nearest_m = nearer(depths.least);
  interval.farthest_m = farther(depths.most);
  if (depths.after_gap - depths.before_gap >= min_gap) {
    interval.gap_nearest_m = farther(depths.before_gap);
    interval.gap_farthest_m = nearer(depths.after_gap);
  }
  return interval;
}

namespace {

/// Returns the residual of an interval without a gap.
std::optional<MotionResidual> segment_residual(const Camera& camera, const Pose& then_from_now,
                                               cv::Point2d now, cv::Point2d then,
                                               const DepthInterval& depth) {
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
    const cv::Vec3d p = turned + translation * inverse_depth;  // scaled: finite at infinity
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

/// Returns the distance between where static points of an interval were and another, metres; below
/// 0 if they went away. Neither has a gap.
double interval_residual_m(const Pose& then_from_now, const cv::Point3d& now_m,
                           const DepthInterval& now, const DepthInterval& then) {
  const auto static_depth_m = [&](double depth_now_m) {
    return (then_from_now * (now_m * (depth_now_m / now_m.z))).z;
  };
  const double nearer_m = then.nearest_m - static_depth_m(now.farthest_m);
  const double farther_m = static_depth_m(now.nearest_m) - then.farthest_m;
  return nearer_m > 0 ? nearer_m : -std::max(farther_m, 0.0);
}

}  // namespace

std::optional<MotionResidual> motion_residual(const Camera& camera, const Pose& then_from_now,
                                              cv::Point2d now, cv::Point2d then,
                                              const DepthInterval& depth) {
  std::optional<MotionResidual> least;
  for (const DepthInterval& side : sides_of(depth)) {
    const auto residual = segment_residual(camera, then_from_now, now, then, side);
    const bool is_less = residual && (!least || residual->distance_px < least->distance_px);
    if (is_less) least = residual;
  }
  return least;
}

double depth_residual_m(const Pose& then_from_now, const cv::Point3d& now_m,
                        const DepthInterval& now, const DepthInterval& then) {
  if (!now.is_known() || !then.is_known()) return 0;
  double least_m = std::numeric_limits<double>::infinity();
  for (const DepthInterval& side_now : sides_of(now)) {
    for (const DepthInterval& side_then : sides_of(then)) {
      const double residual_m = interval_residual_m(then_from_now, now_m, side_now, side_then);
      if (std::abs(residual_m) < std::abs(least_m)) least_m = residual_m;
    }
  }
  return least_m;
}

}  // namespace dynfilter::detail
