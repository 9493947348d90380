// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// One instance on its way from the frame of its mask to the newest frame.

#ifndef DYNFILTER_SRC_SEGMENTERS_PROPAGATION_TRACKED_INSTANCE_HPP
#define DYNFILTER_SRC_SEGMENTERS_PROPAGATION_TRACKED_INSTANCE_HPP

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/instance.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "motion_map.hpp"
#include "point_flow.hpp"

namespace dynfilter::detail {

/// How the image moved into a frame from the one before it.
struct FlowStep {
  std::uint64_t frame_id = 0;
  double timestamp_s = 0;
  double duration_s = 0;  // since the frame before
  std::vector<PointMotion> motions;
};

class TrackedInstance {
 public:
  /// Takes an instance of a frame of that time and size. Pixels outside the image are cut off the
  /// mask, of which a copy is kept.
  TrackedInstance(const Instance& instance, double timestamp_s, const cv::Size& image,
                  float cell_px);

  /// Takes over what an earlier sight of the same object knows: its velocity.
  void succeed(const TrackedInstance& earlier);

  /// Moves it into the next frame.
  void advance(const FlowStep& step, const MaskPropagatorOptions& options);

  /// Settles where mask and box are now; to be called once a frame, after the last step into it.
  void settle();

  /// As it was given, before any step; else box and mask at the newest frame, clipped to the image.
  Instance instance() const;

  /// Nothing of it is in the image any more. Never so before the first step.
  bool has_left_image() const;

  int class_id() const { return source_.class_id; }
  double timestamp_s() const { return timestamp_s_; }

  /// Where the box was in the frame of that time, if it was moved into that; else where it is now.
  /// May reach beyond the image.
  cv::Rect2d box_at(double time_s) const;

  /// The part of the image that it takes up now.
  cv::Rect region() const;

  /// How it got here. Age and misses are not known here.
  const InstancePropagation& counts() const { return counts_; }

 private:
  struct PastBox {
    double timestamp_s;
    cv::Rect2d box;
  };

  bool fills_box() const;
  bool is_inside(cv::Point pixel, int reach) const;
  std::vector<PointMotion> motions_on_mask(const FlowStep& step,
                                           const MaskPropagatorOptions& options) const;
  std::vector<PointMotion> motions_in_box(const std::vector<PointMotion>& all) const;
  bool has_gone_out(const std::vector<PointMotion>& on_mask, const FlowStep& step) const;
  void move_by_flow(const std::vector<PointMotion>& motions, bool as_one,
                    const MaskPropagatorOptions& options, double duration_s);
  void shift(cv::Point2d by);
  void fit_box();

  Instance source_;
  cv::Mat mask_;  // the part of the source's that is on the object and in the image
  cv::Point mask_origin_;
  double timestamp_s_;
  cv::Size image_;
  MotionMap map_;
  cv::Rect2d box_;          // moved
  cv::Rect2d shifted_box_;  // moved in one piece
  std::deque<PastBox> past_;
  std::optional<cv::Point2d> velocity_px_s_;
  InstancePropagation counts_;
  cv::Mat moved_mask_;
  cv::Point moved_origin_;
  bool is_moved_ = false;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_PROPAGATION_TRACKED_INSTANCE_HPP
