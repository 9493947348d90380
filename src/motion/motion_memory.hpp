// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What MotionState holds.

#ifndef DYNFILTER_SRC_MOTION_MOTION_MEMORY_HPP
#define DYNFILTER_SRC_MOTION_MOTION_MEMORY_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "dynfilter/frame.hpp"
#include "dynfilter/motion/feature_tracker.hpp"
#include "dynfilter/motion/instance_motion.hpp"
#include "dynfilter/motion/motion_beliefs.hpp"
#include "dynfilter/motion/relative_pose.hpp"

namespace dynfilter::detail {

/// Number of earlier frames that the long baseline needs.
constexpr auto past_frames = static_cast<std::size_t>(motion_baseline_frames.back());

struct MotionMemory {
  struct Frame {
    ImagePyramid pyramid;
    FrameView frame;  // only its depth: a copy
    double timestamp_s = 0;
    std::optional<RelativePose> motion;  // from it to the frame before it
  };

  Frame now;
  std::array<Frame, past_frames> past;  // the last frame first
  std::size_t known = 0;                // how many of them
  std::optional<MotionBeliefs> beliefs;
  std::optional<InstanceMotion> instances;
  double instances_s = 0;          // time of the last frame whose masks were known
  std::optional<PosePrior> prior;  // of the host
  std::array<std::vector<FeatureTrack>, motion_baseline_frames.size()> host_tracks;  // empty: none
  std::size_t repeats = 0;                // frames that came after the last one, with its image
  std::optional<PosePrior> over_repeats;  // of the host, from the last one to the latest
  std::size_t frames_since_repeat = past_frames;  // at most past_frames
  bool is_tracked_ahead = false;  // whether `now` and its tracks were made before the call
  std::vector<FeatureTrack> tracked_ahead;  // to the last frame

  /// Makes the present frame the last one.
  void push(const FrameView& frame) {
    frame.depth.copyTo(now.frame.depth);
    now.frame.metres_per_unit = frame.metres_per_unit;
    for (std::size_t i = past_frames - 1; i > 0; --i) std::swap(past[i], past[i - 1]);
    std::swap(past[0], now);
    known = std::min(known + 1, past_frames);
    frames_since_repeat = std::min(frames_since_repeat + 1, past_frames);
  }

  /// Forgets the earlier frames, and what was concluded from them. Keeps memory.
  void forget() {
    known = 0;
    repeats = 0;
    frames_since_repeat = past_frames;
    if (beliefs) beliefs->clear();
    if (instances) instances->clear();
  }

  /// Passes over a frame whose image repeats the last one. What the host knows of the camera's
  /// motion is kept for the next frame, whose prior begins here.
  void pass_over_repeat() {
    over_repeats = repeats == 0 ? prior : joined(over_repeats, prior);
    ++repeats;
    frames_since_repeat = 0;
  }

  /// Lets the host's prior begin at the last frame, and not at an image that repeated it. Drops it
  /// where the host did not know all of that.
  void join_repeats() {
    if (repeats > 0) prior = joined(over_repeats, prior);
    repeats = 0;
  }

  /// Forgets what was handed over for one frame.
  void end_frame() {
    prior.reset();
    is_tracked_ahead = false;
    for (std::vector<FeatureTrack>& tracks : host_tracks) tracks.clear();
  }

  /// Forgets everything, the options of the judge that used it among them.
  void reset() {
    forget();
    end_frame();
    beliefs.reset();
    instances.reset();
  }

 private:
  /// Returns what is known of two motions, one after the other; nothing where one is not known.
  static std::optional<PosePrior> joined(const std::optional<PosePrior>& earlier,
                                         const std::optional<PosePrior>& later) {
    if (!earlier || !later) return {};
    return PosePrior{earlier->pose * later->pose,
                     earlier->max_translation_m + later->max_translation_m,
                     earlier->max_rotation_rad + later->max_rotation_rad,
                     earlier->is_trusted && later->is_trusted};
  }
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_MOTION_MEMORY_HPP
