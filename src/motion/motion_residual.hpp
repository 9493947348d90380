// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <limits>
#include <optional>

#include <opencv2/core.hpp>

#include "dynfilter/camera.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/motion/relative_pose.hpp"

namespace dynfilter::detail {

/// Depths that a feature may have, metres along the optical axis. By default, of an unknown one.
struct DepthInterval {
  double nearest_m = 0.4;                                       ///< above 0
  double farthest_m = std::numeric_limits<double>::infinity();  ///< at least `nearest_m`
  /// @{
  /// The depths between these two are left out: at the edge of a thing, a feature is on the thing
  /// or on what is behind it, not between them. Within the interval; equal = none.
  double gap_nearest_m = 0;
  double gap_farthest_m = 0;
  /// @}

  /// Whether it was measured.
  bool is_known() const { return farthest_m < std::numeric_limits<double>::infinity(); }
  /// Whether depths are left out.
  bool has_gap() const { return gap_nearest_m < gap_farthest_m; }
};

/// Returns the depths in the window of 9x9 pixels around a pixel, widened by two standard
/// deviations of the sensor: a corner may belong to either side of a depth edge, and depth may be
/// registered a few pixels off. The gap is between the two depths that lie nearest to the middle of
/// the window's range, if they are at least 0.3 m apart and the noise leaves any of it. Without any
/// depth in the window, from 0.4 m to infinity.
DepthInterval depth_interval(const FrameView& frame, cv::Point pixel);

/// Returns the square of pixels that reaches so far from its centre.
inline cv::Rect square_around(cv::Point centre, int reach_px) {
  return {centre.x - reach_px, centre.y - reach_px, 2 * reach_px + 1, 2 * reach_px + 1};
}

/// Outcome of motion_residual.
struct MotionResidual {
  double distance_px = 0;    ///< from the tracked pixel to the nearest place of a static point
  cv::Point2d static_place;  ///< that place, an ideal pixel of the earlier frame
};

/// Returns how far a tracked feature is from where it would be if it were static. A static feature
/// at an unknown depth within an interval was, in the earlier frame, on a segment of its epipolar
/// line, or on one of two if the interval has a gap; the residual is the distance to the nearest,
/// in ideal pixels of the earlier frame. `now` and `then` are ideal pixels of the two frames. None
/// if no depth of the interval was in front of the camera then. Pure; O(1).
std::optional<MotionResidual> motion_residual(const Camera& camera, const Pose& then_from_now,
                                              cv::Point2d now, cv::Point2d then,
                                              const DepthInterval& depth);

/// Returns by how much nearer a tracked feature came than a static one, metres along the optical
/// axis; below 0 if it went away. What moves along the view hardly shifts in the image. `now_m` is
/// the feature's point in the present camera, `now` the depths around it, and `then` those around
/// its track in the earlier frame. The intervals are widened by the sensor's noise, and hold both
/// sides of a depth edge. The residual is the distance between their nearest depths as the earlier
/// camera sees them: 0 where they overlap or one is not measured. Pure; O(1).
double depth_residual_m(const Pose& then_from_now, const cv::Point3d& now_m,
                        const DepthInterval& now, const DepthInterval& then);

}  // namespace dynfilter::detail
