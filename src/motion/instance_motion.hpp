// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/best_pairs.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// Votes of an instance's features on its motion, in one frame.
struct InstanceVotes {
  std::size_t tracked = 0;  ///< those that were tracked over some baseline
  std::size_t moving = 0;   ///< those whose ratio is above 1
  /// Whether most tracked members were at their static places over the short baseline, and also
  /// over the long one if enough were tracked over it. False if too few were tracked over the short
  /// one. A member whose depth changed counts as off its place.
  bool is_quiet = false;
  bool is_complete = true;  ///< whether enough were tracked over both baselines
};

/// Verdict on each instance, which follows it from frame to frame: what moves says so at once; what
/// is still must be so for some frames.
class InstanceMotion {
 public:
  /// Takes the number of quiet frames after which an instance is still, above 0.
  explicit InstanceMotion(int still_frames) : still_frames_(still_frames) {}

  /// Begins a frame: matches its instances to those of the last frame, by track_id where both have
  /// one, otherwise to those of their class by the overlap of boxes, the largest first. Instances
  /// that are missing are forgotten. O(instances² log instances).
  void begin_frame(const Segmentation& segmentation);

  /// Returns the verdict on instance k of the frame, once a frame, from its votes. None = nothing
  /// could be judged in this frame: undecided, and as many quiet frames are cancelled as by one
  /// that is not quiet. A quiet frame that is not complete neither adds nor cancels any. O(1).
  InstanceVerdict judge(std::size_t k, const std::optional<InstanceVotes>& votes);

  /// Tells whether instance k of the frame was still by the earlier frames, once they and this one
  /// are matched. O(1).
  bool was_still(std::size_t k) const { return known_.at(k).was_still; }

  /// Tells whether the verdict on instance k of the frame can be relied on: it was still for so
  /// long that one frame that is not quiet does not change that, or it moved in some frames in a
  /// row. A single frame may take a person who stays for one who moves. O(1).
  bool is_settled(std::size_t k) const;

  /// Forgets everything.
  void clear() { known_.clear(); }

 private:
  struct Object {
    int class_id;
    cv::Rect box;
    std::optional<int> track_id;
    int quiet_frames = 0;
    int moving_frames = 0;   // in a row
    bool was_still = false;  // by the verdict of the last frame
    bool is_still = false;   // by that of this frame
  };

  int still_frames_;
  std::vector<Object> known_, last_;
  BestPairs pairs_;
};

}  // namespace dynfilter::detail
