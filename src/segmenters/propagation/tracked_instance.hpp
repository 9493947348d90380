// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/instance.hpp"
#include "motion_map.hpp"
#include "point_flow.hpp"

namespace dynfilter::detail {

/// Frames for which the image's motion is remembered: the largest delay of a result for which the
/// motion since is known.
constexpr std::size_t history_frames = 30;

/// The image's motion from the frame before into a frame.
struct FlowStep {
  std::uint64_t frame_id = 0;
  double timestamp_s = 0;
  double duration_s = 0;  // since the frame before
  std::vector<PointMotion> motions;
};

/// Moves one instance from the frame of its mask to the newest frame.
class TrackedInstance {
 public:
  /// Takes an instance of a frame of this time and size. Cuts off mask pixels outside the image and
  /// keeps a copy of the rest.
  TrackedInstance(const Instance& instance, double timestamp_s, const cv::Size& image);

  /// Takes over the velocity of an earlier detection of the same object.
  void succeed(const TrackedInstance& earlier) { velocity_px_s_ = earlier.velocity_px_s_; }

  /// Moves the instance into the next frame.
  void advance(const FlowStep& step);

  /// Determines mask and box at the current frame; call it once a frame, after the last step into
  /// it.
  void settle();

  /// Returns the instance as it was given, before any step; otherwise with box and mask at the
  /// newest frame, clipped to the image.
  Instance instance() const;

  /// Tells whether nothing of it is in the image any more; false before the first step.
  bool has_left_image() const;

  int class_id() const { return source_.class_id; }
  double timestamp_s() const { return timestamp_s_; }

  /// Returns the box in the frame of that time if it was moved into that frame, otherwise the
  /// current one. It may reach beyond the image.
  cv::Rect2d box_at(double time_s) const;

  /// Returns the part of the image that the instance covers now.
  cv::Rect region() const;

 private:
  bool is_inside(cv::Point pixel, int reach) const;
  std::vector<PointMotion> motions_on_mask(const FlowStep& step) const;
  std::vector<PointMotion> motions_in_box(const std::vector<PointMotion>& all) const;
  bool has_gone_out(const std::vector<PointMotion>& on_mask, const FlowStep& step) const;

  Instance source_;
  cv::Mat mask_;  // the part of the source's mask on the object and in the image
  cv::Point mask_origin_;
  double timestamp_s_;
  cv::Size image_;
  MotionMap map_;
  cv::Rect2d box_;                                  // moved
  std::deque<std::pair<double, cv::Rect2d>> past_;  // boxes by the times of frames
  std::optional<cv::Point2d> velocity_px_s_;
  cv::Mat moved_mask_;
  cv::Point moved_origin_;
  bool is_moved_ = false;
};

}  // namespace dynfilter::detail
