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
#include "point_flow.hpp"

namespace dynfilter::detail {

/// Frames for which the image's motion is remembered: the largest delay of a result for which the
/// motion since is known.
constexpr std::size_t history_frames = 30;

/// Returns an instance's box, or the rectangle of its mask if the box is not known.
inline cv::Rect place_of(const Instance& instance) {
  return instance.box.empty() ? cv::Rect(instance.mask_origin, instance.mask.size()) : instance.box;
}

/// The image's motion from the frame before into a frame.
struct FlowStep {
  std::uint64_t frame_id = 0;
  double timestamp_s = 0;
  double duration_s = 0;  // since the frame before
  std::vector<PointMotion> motions;
};

/// Maps each pixel of a frame to its place in an earlier one. Displacements are known at the nodes
/// of a square grid over the image; they are linear in between, and constant beyond. The grid moves
/// with the object, which keeps its outline sharp.
class MotionMap {
 public:
  /// Makes the identity for images of this size.
  explicit MotionMap(const cv::Size& image);

  /// Returns the place in the earlier frame of a point of this frame.
  cv::Point2f source_of(cv::Point2f point) const { return point + displacement_at(point); }

  /// Moves on to the next frame, by the mean of the motions around each node, with Gaussian weights
  /// of their distance and a small weight for `common`. O(motions x nodes within 3 sigma + nodes).
  void move(const std::vector<PointMotion>& motions, cv::Point2f common, float sigma_px);

  /// Returns the mask at this frame, of the image's size. `mask` lies at `origin` in the earlier
  /// frame. O(pixels).
  cv::Mat1b moved(const cv::Mat& mask, cv::Point origin) const;

 private:
  cv::Point2f node(int x, int y) const {
    return origin_ +
           cv::Point2f(static_cast<float>(x * cell_px_), static_cast<float>(y * cell_px_));
  }
  cv::Point2f displacement_at(cv::Point2f point) const;

  cv::Size image_;
  int cell_px_;         // distance of the nodes
  cv::Point2f origin_;  // of the first one, less than a cell outside the image
  cv::Mat_<cv::Point2f> displacements_;
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
  std::deque<std::pair<double, cv::Rect2d>> past_;  // boxes by the times of frames, once moved
  std::optional<cv::Point2d> velocity_px_s_;
  cv::Mat moved_mask_;
  cv::Point moved_origin_;
};

}  // namespace dynfilter::detail
