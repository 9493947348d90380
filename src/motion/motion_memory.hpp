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

/// Number of earlier frames that the longest baseline needs.
constexpr std::size_t past_frames = 3;

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
  std::optional<PosePrior> prior;                                       // of the host
  std::array<std::vector<FeatureTrack>, motion_baselines> host_tracks;  // empty: none
  bool is_tracked_ahead = false;  // whether `now` and its tracks were made before the call
  std::vector<FeatureTrack> tracked_ahead;  // to the last frame

  /// Makes the present frame the last one.
  void push(const FrameView& frame) {
    frame.depth.copyTo(now.frame.depth);
    now.frame.metres_per_unit = frame.metres_per_unit;
    for (std::size_t i = past_frames - 1; i > 0; --i) std::swap(past[i], past[i - 1]);
    std::swap(past[0], now);
    known = std::min(known + 1, past_frames);
  }

  /// Forgets the earlier frames, and what was concluded from them. Keeps memory.
  void forget() {
    known = 0;
    if (beliefs) beliefs->clear();
    if (instances) instances->clear();
  }

  /// Forgets what was handed over for one frame.
  void end_frame() {
    prior.reset();
    is_tracked_ahead = false;
    for (std::vector<FeatureTrack>& tracks : host_tracks) tracks.clear();
  }
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_MOTION_MEMORY_HPP
