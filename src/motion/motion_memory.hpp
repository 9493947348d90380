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
/// Every so many frames, one is kept longer. Of the two that are kept, the older one is used.
constexpr std::size_t kept_spacing_frames = 4;

struct MotionMemory {
  struct Frame {
    ImagePyramid pyramid;
    FrameView frame;  // only its depth: a copy
    double timestamp_s = 0;
    std::optional<RelativePose> motion;  // from it to the frame before it
  };

  /// Frame that is kept when it is no longer one of the last few.
  struct KeptFrame {
    ImagePyramid pyramid;
    double timestamp_s = 0;
    RelativePose kept_from_last;  ///< takes a point of the last frame's camera into this one's
    std::size_t frames_back = 0;  ///< from the next frame; 0: there is none
  };

  Frame now;
  std::array<Frame, past_frames> past;  // the last frame first
  std::size_t known = 0;                // how many of them
  std::array<KeptFrame, 2> kept;        // the older first
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

  /// Makes the present frame the last one. `keeps`: whether frames are kept.
  void push(const FrameView& frame, bool keeps = false) {
    frame.depth.copyTo(now.frame.depth);
    now.frame.metres_per_unit = frame.metres_per_unit;
    for (std::size_t i = past_frames - 1; i > 0; --i) std::swap(past[i], past[i - 1]);
    std::swap(past[0], now);
    const bool has_left = known == past_frames;  // whether a frame left `past`; it is in `now`
    known = std::min(known + 1, past_frames);
    frames_since_repeat = std::min(frames_since_repeat + 1, past_frames);
    follow_kept(keeps);
    if (keeps && has_left) keep_oldest();
  }

  /// Forgets the earlier frames, and what was concluded from them. Keeps memory.
  void forget() {
    known = 0;
    repeats = 0;
    frames_since_repeat = past_frames;
    for (KeptFrame& one : kept) one.frames_back = 0;
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

  /// Follows the camera from the kept frames to the last one; drops them where it is lost, or if
  /// none are to be kept.
  void follow_kept(bool keeps) {
    for (KeptFrame& one : kept) {
      if (one.frames_back == 0) continue;
      const bool goes_on = keeps && past[0].motion;
      one.frames_back = goes_on ? one.frames_back + 1 : 0;
      if (goes_on) one.kept_from_last = one.kept_from_last * *past[0].motion;
    }
  }

  /// Keeps the frame that just left `past` and is in `now`, if it is time.
  void keep_oldest() {
    const std::size_t frames_back = past_frames + 1;
    KeptFrame& newest = kept[1];
    const bool is_time =
        newest.frames_back == 0 || newest.frames_back >= frames_back + kept_spacing_frames;
    if (!is_time || !past[0].motion || !past[1].motion || !past[2].motion) return;
    std::swap(kept[0], kept[1]);
    std::swap(newest.pyramid, now.pyramid);
    newest.timestamp_s = now.timestamp_s;
    newest.kept_from_last = *past[2].motion * *past[1].motion * *past[0].motion;
    newest.frames_back = frames_back;
  }
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_MOTION_MEMORY_HPP
