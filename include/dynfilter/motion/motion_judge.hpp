// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_MOTION_JUDGE_HPP
#define DYNFILTER_MOTION_MOTION_JUDGE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <memory>
#include <vector>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/motion/feature_tracker.hpp"
#include "dynfilter/motion/instance_motion.hpp"
#include "dynfilter/motion/motion_beliefs.hpp"
#include "dynfilter/motion/motion_residual.hpp"
#include "dynfilter/motion/motion_state.hpp"
#include "dynfilter/motion/motion_votes.hpp"
#include "dynfilter/motion/pinhole_camera.hpp"
#include "dynfilter/motion/relative_pose.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Options of MotionJudge. The defaults were chosen on rendered scenes of seeds 11 to 13 and on
/// recorded frames.
struct MotionJudgeOptions {
  FeatureTrackerOptions tracker;   ///< for the tracks
  RelativePoseOptions pose;        ///< for the camera's motion
  DepthIntervalOptions depth;      ///< for the places of a static feature
  MotionVotesOptions votes;        ///< for the support by neighbours
  MotionBeliefOptions belief;      ///< for what is believed of a feature
  InstanceMotionOptions instance;  ///< for the verdict on an instance

  /// A longer time after the last frame whose image was new, everything starts anew, seconds. A
  /// longer time after the last known masks, their verdicts are forgotten.
  double max_gap_s = 0.5;
  /// Share of the features that must be tracked from the last frame; below, it is a cut.
  double min_tracked_share = 0.25;
  /// @{
  /// Largest acceleration of the camera: without masks, its motion may be so far from the last one,
  /// if that is known; a millimetre and a milliradian a frame at least. 0 in either = no limit. A
  /// limit keeps the pose from following the movers where most features are on them. With masks,
  /// most features that are left are static, and a limit would only hold back a shaken camera. With
  /// a trusted prior the long baseline has the same limits around the host's motions; there, each 0
  /// lifts its own limit only.
  double max_acceleration_m_s2 = 5;
  double max_angular_acceleration_rad_s2 = 20;
  /// @}
  /// Features this near to a mask of a dynamic object are suspected as those on it, pixels.
  double mask_distance_px = 8;
  /// A feature without depth takes the middle of its DepthInterval for the camera's motion, if the
  /// interval, noise of the sensor included, spans less than this, metres.
  double max_pose_depth_range_m = 0.3;
  /// @{
  /// The camera's pose comes from the features that nobody suspects. A second one, by these and by
  /// what compensation removed, takes its place if the first is not trusted, or if the median
  /// residual of the unsuspected features is at most max_worse_fit times that by the first, plus
  /// max_worse_fit_px. The same limits hold for the scale of the pose of a camera that only turns.
  double max_worse_fit = 1.3;
  double max_worse_fit_px = 0.1;
  /// @}
  /// @{
  /// With masks and without a trusted prior, two more poses are tried: the one by the features of
  /// people who stood until now, too, unless most features are suspected, and the one without
  /// translation. Each must fit as well as the one so far, by the limits above. It is taken if the
  /// number of features that agree with it is more than so many times that of the other; infinity =
  /// never. A feature agrees within so many pixels.
  double min_agreement_gain = 1.1;
  double agreement_px = 0.5;
  /// @}
  /// The pose over three frames should be that of the three single frames, one after the other. The
  /// long baseline is not used where the two place a tenth of the features with depth farther apart
  /// than this, pixels; infinity = it always is.
  double max_baseline_difference_px = 6;

  /// @{
  /// A feature becomes a seed if it shifts by more than the largest of three limits: so many
  /// pixels; so many scales of the camera's pose (RelativePoseEstimate::scale_px, 0.25 to 3
  /// pixels, with a trusted prior also more); and the shift of a thing at the feature's depth that
  /// crosses the view at this speed. The last two also limit the change of its depth, beyond the
  /// sensor's noise. The limit in pixels is the larger one for what is far: at 30 frames a second
  /// and a focal length of 525 px, 1.5 px over three frames are 0.06 m/s at 2 m, 0.11 at 4 m.
  double min_shift_px = 1.5;
  double min_shift_scales = 6;
  double min_speed_m_s = 0.05;
  /// @}
  /// @{
  /// A seed's patch must fit the place where it was tracked much better than the static place: by
  /// this share of its contrast, and with at most this share of the static place's difference.
  double min_patch_gain = 0.2;
  double max_patch_ratio = 0.75;
  /// @}
  /// Tracks fail beside what moves. A feature that shifts or was not tracked is static nevertheless
  /// if its patch differs from the static place by less than this share of its contrast.
  double max_static_patch_ratio = 0.5;
  /// A feature this near to the mask of a dynamic object is beside it, pixels. Elsewhere, a feature
  /// without a track is a seed if the last frame's depth says that a static one would have been in
  /// view there, and its image does not show one. Beside an object it is not: the object may have
  /// hidden it. Nor does it join seeds from afar there, see MotionVotesOptions.
  double beside_object_px = 60;
  /// @{
  /// The fill: a feature of unclear motion moves if most features around it do, at least two,
  /// unless the image shows it at the static place. A feature with neither a track nor a depth is
  /// left alone: nothing is known of it. By the same share, new features between those believed to
  /// move do not tell the camera's motion.
  int fill_radius_px = 25;      ///< features within this distance are around it, pixels
  double min_fill_share = 0.6;  ///< "most": above this share of them
  /// A motion is clear below this share of the allowed shift: the feature is not filled, and may
  /// come back beside something that moves.
  double max_clear_ratio = 0.3;
  /// @}

  /// Features whose depths differ by more are on different things, metres: they do not count for
  /// the fill, and one so far behind most of an instance's features is not in its fringe.
  double max_thing_depth_m = 0.3;
  /// @{
  /// Masks older than the first are stale, seconds. Those older than the second have no time, and
  /// count as fresh. MotionFilter sets both as in DepthCompensatorOptions. The features on stale
  /// masks may be the background's, and their depths do not tell who is in the fringe.
  double stale_age_s = 0.02;
  double max_age_s = 1.0;
  /// @}

  /// @{
  /// An instance is quiet if most of its tracked features shift by at most the largest of these:
  /// pixels, scales, and the shift of a thing at its depth that crosses the view at this speed.
  double max_quiet_px = 0.75;
  double max_quiet_scales = 2.5;
  double max_quiet_speed_m_s = 0.06;
  /// @}
  double quiet_share = 0.7;         ///< "most" of its tracked features
  double min_quiet_tracked = 0.5;   ///< share of its features that must be tracked
  std::size_t min_quiet_votes = 8;  ///< and their number, as that of depths for its fringe

  /// A feature that compensation removed comes back only if it is static itself. Beside a still
  /// instance it always does. Beside an instance that moves, or that was quiet in every judged
  /// frame, it does so only if the earlier stages kept at least this share of all features: with
  /// fewer, the camera's motion may have been taken from persons.
  double min_kept_share = 0.5;
  /// Beside something that moves, a feature comes back if it was at the static place over both
  /// baselines, or if the image shows it there. Its DepthInterval must span less than this, metres.
  double max_background_depth_range_m = 0.4;

  /// Features this near to the mask of an instance that is not still are judged strictly, pixels:
  /// masks miss what moves with it.
  double fringe_px = 30;
  double fringe_shift_px = 1.0;    ///< allowed shift there, pixels
  double fringe_shift_scales = 3;  ///< and in scales
  /// @{
  /// Features in the fringe that cannot be tracked are removed within this distance of the mask, at
  /// most `fringe_px`: the mask may miss a rim of the object, or be left behind. This costs static
  /// features that the object hid until now.
  double fringe_untracked_px = 4;         ///< while masks are fresh
  double stale_fringe_untracked_px = 15;  ///< while they are stale, see stale_age_s
  /// @}
};

/// Decides by motion: features that move lose their place whatever they are on, and an object that
/// masks call dynamic but that stands still gets its features back. Masks and depth say what may be
/// dynamic, motion says what is. A stage for after the compensator and before FeatureFloor.
///
/// Each frame, features are tracked 1 and 3 frames back, and the camera's motion is estimated from
/// those that nobody suspects: they lie off the masks, did not move before, and are not new among
/// features that did. Those that compensation removed farther from the masks join in where they
/// agree with the others. So do those of a person who stood until now: they show the camera's
/// motion. What was removed for no object never does: a static mask, or a host's own stage.
/// A track is compared with where the feature would have been if it were static, at any depth that
/// it may have, and the depth there with the depth it would have had. One feature in one frame
/// proves little: tracks fail at occlusions and between layers of depth. So evidence is pooled over
/// neighbours, over time and over instances: a feature that no neighbour supports is removed in the
/// seventh frame in a row. Where a track fails or shifts, the image decides: a feature is static if
/// it looked the same at the static place, and may move if it would have been in view there, and
/// was not. What lies in front of its surface, as a person beside it, is left out of the
/// comparison.
///
/// Abstains, changes nothing and says why in MotionStatistics: without an image, in the first
/// frame, after a cut, a gap or a step back in time, where an image repeats, and where the tracks
/// agree on no motion of the camera. In a frame in which it abstains, people who stand lose what
/// they had got back.
///
/// What is slower than min_speed_m_s is static by definition, and what is up to twice as fast, or
/// far away, is often missed. An instance with fewer than min_quiet_votes tracked features never
/// becomes still.
///
/// The image must be CV_8UC1 or CV_8UC3 (or CV_8UC4). Uses `frame.depth` where it exists, but not
/// the depths of FeaturesView; without depth it needs a trusted prior in each frame, see
/// MotionState::expect_motion. `frame.timestamp_s` must grow from frame to frame: with equal times
/// it starts anew in each of them. Baselines, beliefs and verdicts count frames and were chosen at
/// 30 frames a second: at 10, all shifts are three times as large, and a verdict takes three times
/// as long. The camera must be that of the features' pixels. Lengths of the options are pixels of
/// the image, at any width.
class MotionJudge {
 public:
  /// Takes the camera, the state, which is the stage's own, and options. Throws
  /// std::invalid_argument for values out of range, and for a state that was moved from.
  MotionJudge(const PinholeCamera& camera, MotionState& state,
              const MotionJudgeOptions& options = {});

  /// Throws std::invalid_argument for an image of another type, and if the number of the host's
  /// tracks is not that of the features; drops what was handed over for the frame then.
  void check(const FilterInput& input) const;

  /// Tracks the features to the last frame, for what needs tracks before the frame's masks are
  /// known: `point_motions(features, tracks)` moves earlier masks, see MaskPropagator. Call the
  /// stage next, with the same frame, depth included, and the same features: it takes these tracks,
  /// and gives the same labels as without. Hand over tracks of your own before. Writes one track
  /// for each feature. Returns whether the last frame is known; otherwise no track is found:
  /// without an image, in the first frame, after a gap or a step back in time. Throws
  /// std::invalid_argument as the call would; after any other exception the state has forgotten
  /// everything. O(pixels + features).
  bool track(const FrameView& frame, FeaturesView features, std::vector<FeatureTrack>& tracks,
             Workspace& workspace) const;

  /// Judges the features. Throws std::invalid_argument as `check`, and for labels of another
  /// number; earlier frames are known as before then. After any other exception the state has
  /// forgotten everything. O(pixels + features x (instances + 1) + instances^3) with the constants
  /// of FeatureTracker and RelativePoseEstimator, and support_seeds.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const;

 private:
  bool look(const FrameView& frame) const;

  PinholeCamera camera_;
  std::shared_ptr<detail::MotionMemory> memory_;  // the state's
  MotionJudgeOptions options_;
  FeatureTracker tracker_;
  RelativePoseEstimator pose_estimator_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_MOTION_JUDGE_HPP
