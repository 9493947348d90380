// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_MOTION_WAIT_HPP
#define DYNFILTER_SRC_PLUGIN_MOTION_WAIT_HPP

#include <cstddef>
#include <string>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

/// Keeps the host from beginning its map before motion is decided, see FrameStatistics: takes all
/// features of its first frames, so that it waits for a better one. Ends for good with the first
/// frame that is decided, and after a number of frames.
class MotionWait {
 public:
  /// Takes the largest number of frames to wait for, 0 = none, and the setting's name for the
  /// sentence.
  MotionWait(std::size_t max_frames, std::string setting)
      : max_frames_(max_frames), frames_left_(max_frames), setting_(std::move(setting)) {}

  /// Removes all features unless the wait is over. Returns a sentence if this is the last frame to
  /// wait for, and still not decided; otherwise an empty text. O(features).
  std::string hold(FeatureLabels& labels) {
    if (labels.statistics().is_motion_decided()) frames_left_ = 0;
    has_masks_ = has_masks_ || labels.statistics().has_segmentation;
    holds_ = frames_left_ > 0;
    if (!holds_) return {};
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (!labels.is_removed(i)) labels.remove(i, -1, Reason::custom, labels[i].score);
    }
    if (--frames_left_ > 0) return {};
    return concatenate("dynfilter: motion was not decided in the first ", max_frames_,
                       max_frames_ == 1 ? " frame" : " frames", ", the most that ", setting_,
                       " allows",
                       has_masks_ ? "" : ", because none of them had masks, which it needs",
                       ": the host may begin its map in the next one, without what still persons "
                       "cover");
  }

  /// Whether the last frame was one to wait for.
  bool holds() const { return holds_; }

 private:
  std::size_t max_frames_;
  std::size_t frames_left_;
  std::string setting_;
  bool has_masks_ = false;  // whether a frame had some
  bool holds_ = false;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_MOTION_WAIT_HPP
