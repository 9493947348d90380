// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tracks, poses and residuals of one frame.

#ifndef DYNFILTER_SRC_MOTION_MOTION_MEASUREMENT_HPP
#define DYNFILTER_SRC_MOTION_MOTION_MEASUREMENT_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/motion/motion_judge.hpp"
#include "motion_memory.hpp"

namespace dynfilter::detail {

/// Why a feature is not to tell the camera's motion.
enum class Suspicion : std::uint8_t {
  none,
  compensated,  ///< compensation removed it, off the masks: most of these are static
  standing,     ///< on or near the mask of an object that was still until now
  moving,       ///< on or near another object's mask, believed to move, or new among those that are
  foreign       ///< removed for no object: it moves with the camera, or a host's stage knows better
};

/// Indices of the baselines: to the last frame, and to the third one back.
constexpr std::size_t short_baseline = 0, long_baseline = 1;

/// One baseline of a frame.
struct MotionBaseline {
  bool is_used = false;  ///< whether the pose is trusted, and shifts are measured
  double duration_s = 0;
  RelativePoseEstimate pose;
  std::vector<FeatureTrack> tracks;
};

/// What the steps write down for themselves; nothing in it outlives a step.
struct MotionScratch {
  std::vector<cv::Point2f> expected;               ///< place over the baseline being tracked
  std::vector<PoseObservation> observations;       ///< of unsuspected features
  std::vector<PoseObservation> more_observations;  ///< of these and of compensated ones
  std::vector<PoseObservation> most_observations;  ///< of these and of standing ones
  std::vector<std::uint8_t> was_moving;            ///< is_moving before filling
  std::vector<float> values, nearest_m;            ///< of which a quantile is wanted
};

/// Everything measured in a frame. In the workspace, so that its memory is used again.
struct MotionMeasurement {
  std::array<MotionBaseline, motion_baselines> baselines;
  std::vector<cv::Point2d> ideal;           ///< ideal pixel of each feature
  std::vector<DepthInterval> depths;        ///< of each feature
  std::vector<Suspicion> suspicions;        ///< of each feature
  std::vector<FeatureMotion> motions;       ///< of each feature
  std::vector<double> beliefs;              ///< of each feature: that it moves, log-odds
  std::vector<std::uint8_t> is_believed;    ///< believed to move before this frame says anything
  std::vector<std::uint8_t> is_moving;      ///< moves, by what this frame says
  std::vector<std::uint8_t> is_given_back;  ///< given back in this frame
  MotionScratch scratch;
};

/// What the parts of the judge have in common.
struct MotionContext {
  const FilterInput& input;
  const PinholeCamera& camera;
  const MotionJudgeOptions& options;
  bool has_masks;  ///< whether masks are known, maybe without instances
  MotionMemory& memory;
  MotionMeasurement& measured;
  Workspace& workspace;

  /// Returns the length of a baseline, frames.
  std::size_t frames_back(std::size_t baseline) const {
    return static_cast<std::size_t>(motion_baseline_frames[baseline]);
  }

  /// Returns the images at the other end of a baseline.
  const ImagePyramid& pyramid_then(std::size_t baseline) const {
    return memory.past[frames_back(baseline) - 1].pyramid;
  }

  /// Returns the time at the other end of a baseline, seconds.
  double timestamp_then_s(std::size_t baseline) const {
    return memory.past[frames_back(baseline) - 1].timestamp_s;
  }

  /// Returns the shift that a speed across the view makes over a baseline, pixels; 0 at an unknown
  /// depth.
  double shift_px(double speed_m_s, double duration_s, const DepthInterval& depth) const {
    return depth.is_known() ? speed_m_s * duration_s * camera.fx / depth.nearest_m : 0;
  }
};

/// Returns the motion that is expected over a baseline: over the short one, the last one goes on;
/// over a longer one, the product of the motions of its frames.
RelativePose expected_pose(const MotionContext& context, std::size_t baseline);

/// Tracks the features over a baseline.
void track_back(const MotionContext& context, const FeatureTracker& tracker, std::size_t baseline);

/// Counts the features that were followed.
inline std::size_t count_found(const std::vector<FeatureTrack>& tracks) {
  return static_cast<std::size_t>(std::count_if(
      tracks.begin(), tracks.end(), [](const FeatureTrack& track) { return track.is_found; }));
}

/// Measures depth and ideal pixel of each feature. Begins their motions anew, with the depth alone.
void measure_places(const MotionContext& context);

/// Estimates the camera's motion over a baseline: the best of four poses.
///
///  1. The pose by the features that nobody suspects. Before a wall a shift and a turn look alike,
///     so that this pose may explain the wall and a mover together.
///  2. The pose by these and by the features that compensation removed. It replaces the first one
///     if it fits the unsuspected features nearly as well, or if those do not suffice. So features
///     near a person who stands are of use. In a crowd they move, and this pose does not fit.
///  3. The pose by these and by the features of people who stood until now. It replaces the one so
///     far if that one is trusted, if it fits the unsuspected features nearly as well, and if
///     `min_agreement_gain` times as many features agree with it. Not where most features are
///     suspected. Before a wall, who walks looks like one who stands before a camera that moves:
///     so it takes those alone whose verdict was still.
///  4. The pose of a camera that only turns, in the same way. Where both may replace it and about
///     as many agree with the turn as with the third one, the turn is taken.
///
/// Without masks most features may be on movers, and a trusted prior for this baseline knows
/// better: the last two are not tried then.
///
/// A pose over a longer baseline is not used where those over the short one contradict it: one of
/// them is wrong then, and nothing tells which.
void estimate_pose(const MotionContext& context, const RelativePoseEstimator& estimator,
                   std::size_t baseline);

/// Measures the shifts of the features, whose places are measured, over the baselines that are
/// used. One that shifts by more than is allowed for, or that was not tracked, is what the image
/// shows: a seed, quiet, or unknown. One whose depth changed is a seed, unless the image shows that
/// its track failed. One that was not tracked is a seed, too, if no object's mask is near, a static
/// one would have been in view in the last frame, and the image does not show it there.
void measure_motions(const MotionContext& context);

/// What the image shows of a feature's surface at the place where a static feature would have been.
enum class Appearance : std::uint8_t {
  unclear,         ///< neither the one nor the other, or nothing that can be compared
  absent,          ///< it was not tracked, and does not look as if it was there
  moved,           ///< the surface was at the tracked place, not there
  fits,            ///< it may have been there, though the tracked place fits better
  at_static_place  ///< it was there
};

/// Compares what a feature lies on with its tracked place and with the static one, over a baseline.
/// At the image's border a tracked feature counts as moved: the image does not contradict.
Appearance appearance_of(const MotionContext& context, std::size_t feature, std::size_t baseline);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_MOTION_MEASUREMENT_HPP
