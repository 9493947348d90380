// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_INSTANCE_MOTION_HPP
#define DYNFILTER_MOTION_INSTANCE_MOTION_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/motion/motion_votes.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Votes of an instance's features on its motion, in one frame.
struct InstanceVotes {
  std::size_t members = 0;  ///< features of the instance
  std::size_t tracked = 0;  ///< those that were tracked over some baseline
  std::size_t moving = 0;   ///< those whose ratio is above 1
  /// Whether most tracked members were at their static places over the short baseline, and also
  /// over the long one if enough were tracked over it. False if too few were tracked over the short
  /// one. A member whose depth changed counts as off its place.
  bool is_quiet = false;
  bool is_complete = true;  ///< whether enough were tracked over both baselines
};

/// Options of InstanceMotion.
struct InstanceMotionOptions {
  double min_moving_share = 0.3;  ///< above this share of its tracked members, an instance moves
  std::size_t min_moving = 3;     ///< and at least so many of them
  int min_still_frames = 4;       ///< quiet frames after which an instance is still; at least 1
  int max_still_frames = 8;       ///< further ones do not count; at least `min_still_frames`
  int min_moving_frames = 3;      ///< frames in a row after which it moves for sure; at least 1
  int cancelled_frames = 3;  ///< a frame that is not quiet cancels so many quiet ones; at least 0
  double min_iou = 0.3;      ///< smallest overlap of the boxes of the same object; 0 to 1
};

/// Verdict on each instance, which follows it from frame to frame: what moves says so at once; what
/// is still must be so for some frames. Not for two threads at once.
class InstanceMotion {
 public:
  /// Takes the options. Throws std::invalid_argument for options out of range.
  explicit InstanceMotion(const InstanceMotionOptions& options = {});

  /// Begins a frame: matches its instances to those of the last frame, by track_id where both have
  /// one, otherwise to those of their class by the overlap of boxes, the largest first. Instances
  /// that are missing are forgotten. O(instances^3).
  void begin_frame(const Segmentation& segmentation);

  /// Returns the verdict on instance k of the frame, once a frame, from its votes. None = nothing
  /// could be judged in this frame: undecided, and as many quiet frames are cancelled as by one
  /// that is not quiet. A quiet frame that is not complete neither adds nor cancels any. O(1).
  InstanceVerdict judge(std::size_t k, const std::optional<InstanceVotes>& votes);

  /// Tells whether instance k of the frame was quiet in each frame that was judged since it
  /// appeared, this one among them. A frame with too few tracked members is not quiet. False before
  /// `judge`. O(1).
  bool was_always_quiet(std::size_t k) const {
    return known_.at(k).is_judged && !known_.at(k).was_restless;
  }

  /// Tells whether instance k of the frame was still by the earlier frames, once they and this one
  /// are matched. O(1).
  bool was_still(std::size_t k) const { return known_.at(k).was_still; }

  /// Tells whether the verdict on instance k of the frame can be relied on: it was still for so
  /// long that one frame that is not quiet does not change that, or for `max_still_frames`; or it
  /// moved in some frames in a row. A single frame may take a person who stays for one who moves.
  /// O(1).
  bool is_settled(std::size_t k) const;

  /// Forgets everything.
  void clear() { known_.clear(); }

 private:
  struct Known {
    int class_id;
    cv::Rect box;
    std::optional<int> track_id;
    int still_frames = 0;
    int moving_frames = 0;      // in a row
    bool was_still = false;     // by the verdict of the last frame
    bool is_still = false;      // by that of this frame
    bool is_matched = false;    // to one of the last frame
    bool is_taken = false;      // by one of the next frame
    bool was_restless = false;  // was not quiet in some frame
    bool is_judged = false;
  };

  bool may_match(const Instance& instance, const Known& known, double& overlap) const;

  InstanceMotionOptions options_;
  std::vector<Known> known_, last_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_INSTANCE_MOTION_HPP
