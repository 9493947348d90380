// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <memory>

#include "dynfilter/camera.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/motion/relative_pose.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

namespace detail {
struct MotionMemory;
}

/// Options of MotionJudge. Its other constants were chosen on rendered scenes of seeds 11 to 16 and
/// on recorded frames; src/motion/ names them with their reasons.
struct MotionJudgeOptions {
  /// What crosses the view, or comes nearer, more slowly is static, metres a second; 0 or more.
  double min_speed_m_s = 0.05;
  /// A longer time after the last frame whose image was new, everything starts anew, seconds. A
  /// longer time after the last known masks, their verdicts are forgotten. Above 0.
  double max_gap_s = 0.5;
  /// Quiet frames after which an object is still; 1 to 1000.
  int still_frames = 4;
  /// Features this near to the mask of an object that is not still are judged strictly, pixels:
  /// masks miss what moves with it. 0 to 1000.
  double fringe_px = 30;
};

/// Decides by motion: removes the features that move, whatever they are on, and keeps those of what
/// stands still, on a mask or beside one. Masks and depth say what may be dynamic, motion says what
/// is. It is a stage for after the compensator and before FeatureFloor. motion/README.md names its
/// steps.
///
/// It remembers earlier frames: one judge for each camera, frames in order of time, one thread at a
/// time. The image is CV_8UC1, CV_8UC3 or CV_8UC4. Without `frame.depth` it needs a trusted prior
/// in each frame. Its constants were chosen at 30 frames a second.
///
/// Where it cannot judge, it changes nothing and says why in MotionStatistics (MotionOutcome). In
/// such a frame, the features of people who stand are removed.
class MotionJudge {
 public:
  /// Takes camera and options, and the age in seconds, 0 or more, beyond which masks are stale: the
  /// features on them may be the background's. Throws std::invalid_argument for values out of
  /// range.
  explicit MotionJudge(const Camera& camera, const MotionJudgeOptions& options = {},
                       double stale_age_s = 0.02);
  /// Moves the judge; the source may only be destroyed or assigned to.
  MotionJudge(MotionJudge&&) noexcept;
  /// Moves the judge; the source may only be destroyed or assigned to.
  MotionJudge& operator=(MotionJudge&&) noexcept;
  ~MotionJudge();

  /// Hands over what the host knows of the camera's motion between the last frame and the next one,
  /// for the next frame only: from its motion model, an inertial sensor or wheels. `prior.pose`
  /// takes a point of the next frame's camera into the last frame's: ORB-SLAM's mVelocity is the
  /// inverse of that. Trust only what is measured: by a wrong pose, everything moves. Where an
  /// image repeats the last one, hand over both motions: they are joined. Throws
  /// std::invalid_argument for a pose that is not finite, a rotation that is none, and limits that
  /// are not above 0.
  void expect_motion(const PosePrior& prior);

  /// Judges the features. Throws std::invalid_argument for an image of another type, and for labels
  /// of another number than the features; earlier frames are known as before then.
  /// After any other exception it has forgotten everything. O(pixels + features x instances +
  /// candidates x features within 80 px).
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace);

  /// Forgets everything, like a new judge.
  void reset();

 private:
  Camera camera_;
  MotionJudgeOptions options_;
  double stale_age_s_;
  RelativePoseEstimator pose_estimator_;
  std::unique_ptr<detail::MotionMemory> memory_;
};

}  // namespace dynfilter
