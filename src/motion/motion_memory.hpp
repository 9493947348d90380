// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What MotionJudge remembers of earlier frames.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "dynfilter/frame.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "instance_motion.hpp"

namespace dynfilter::detail {

/// Lengths of the short and the long baseline, frames. The short one sees what is fast, the long
/// one what is slow.
constexpr std::array<int, 2> baseline_frames = {1, 3};
constexpr std::size_t baselines = baseline_frames.size();
constexpr std::size_t short_baseline = 0, long_baseline = 1;
constexpr auto past_frames = static_cast<std::size_t>(baseline_frames[long_baseline]);

/// Feature of the last frame that was believed to move.
struct Mover {
  cv::Point2f expected;  // its place in this frame, if its motion goes on
  cv::Point2f flow;      // that motion, pixels a frame
  float depth_m = 0;     // 0 = unknown
};

struct MotionMemory {
  static constexpr std::size_t levels = 3;  // of the grey image: itself, its half and its quarter

  struct Frame {
    std::array<cv::Mat1b, levels> grey;
    FrameView frame;  // only its depth: a copy
    double timestamp_s = 0;
    std::optional<Pose> motion;  // from it to the frame before it
  };

  Frame now;
  std::array<Frame, past_frames> past;  // the last frame first
  std::size_t known = 0;                // how many of them
  std::vector<cv::Point2f> points;      // features of the last frame, raw pixels
  std::vector<float> beliefs;           // about them
  FrameFeatures index;                  // of the points
  std::vector<Mover> movers;
  InstanceMotion instances;
  double instances_s = 0;                 // time of the last frame whose masks were known
  std::optional<PosePrior> handed_over;   // by the host, for the next frame
  std::optional<PosePrior> prior;         // of this frame
  std::size_t repeats = 0;                // frames that came after the last one, with its image
  std::optional<PosePrior> over_repeats;  // of the host, from the last one to the latest

  explicit MotionMemory(int still_frames) : instances(still_frames) {}

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
    repeats = 0;
    points.clear();
    beliefs.clear();
    movers.clear();
    index.read(points);
    instances.clear();
  }

  /// Passes over a frame whose image repeats the last one. What the host knows of the camera's
  /// motion is kept for the next frame, whose prior begins here.
  void pass_over_repeat() {
    over_repeats = repeats == 0 ? prior : joined(over_repeats, prior);
    ++repeats;
  }

  /// Lets the host's prior begin at the last frame, and not at an image that repeated it. Drops it
  /// where the host did not know all of that.
  void join_repeats() {
    if (repeats > 0) prior = joined(over_repeats, prior);
    repeats = 0;
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
