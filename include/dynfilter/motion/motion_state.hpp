// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_MOTION_STATE_HPP
#define DYNFILTER_MOTION_MOTION_STATE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <memory>
#include <vector>

#include "dynfilter/motion/feature_tracker.hpp"
#include "dynfilter/motion/motion_votes.hpp"
#include "dynfilter/motion/relative_pose.hpp"

namespace dynfilter {

namespace detail {
struct MotionMemory;
}

/// Memory of MotionJudge: what it knows of one camera's earlier frames. It is yours, so that
/// filters stay immutable: one state for each camera and each judge, and not for two threads at
/// once. Two states share nothing; equal frames in equal order lead to equal states. A judge shares
/// what its state holds, so the two may be moved, together or alone, and either may die first. To
/// let a judge forget, call `reset`: assigning another state to this one leaves the judge as it is.
/// What is handed over for the next frame waits until the judge sees one: call `reset`, or hand
/// over again, after a frame that another part of a filter refused.
///
/// Memory at 640x480: four image pyramids with derivatives (2.6 MB each), four depth images as the
/// host's are (0.6 or 1.2 MB each), and the features of the last frame.
class MotionState {
 public:
  /// Makes a state that knows nothing.
  MotionState();
  /// Moves the state; the source may only be destroyed or assigned to.
  MotionState(MotionState&&) noexcept;
  /// Moves the state; the source may only be destroyed or assigned to.
  MotionState& operator=(MotionState&&) noexcept;
  ~MotionState();

  /// Hands over what the host knows of the camera's motion between the last frame and the next one,
  /// for the next frame only: from its motion model, an inertial sensor or wheels. `prior.pose`
  /// takes a point of the next frame's camera into the last frame's: ORB-SLAM's mVelocity is the
  /// inverse of that. Its limits are what the source may be wrong by. Without depth a trusted prior
  /// is needed. Trust only what is measured: by a wrong pose, everything moves. Where an image
  /// repeats the last one, hand over both motions, to it and from it: they are joined. Throws
  /// std::invalid_argument for a pose that is not finite, for a rotation that is none, and for
  /// limits that are not above 0.
  void expect_motion(const PosePrior& prior);

  /// Hands over the host's own tracks of the next frame's features, for that frame only: where they
  /// were motion_baseline_frames[baseline] frames ago. They are refined, see
  /// FeatureTracker::refine. For two frames after an image that repeats another, those over the
  /// long baseline are not used. An empty vector hands over nothing. Throws std::invalid_argument
  /// for a baseline other than 0 and 1; the judge throws it if the number of tracks is not that of
  /// the features.
  void hand_over_tracks(std::size_t baseline, std::vector<FeatureTrack> tracks);

  /// Forgets everything, like a new state.
  void reset();

 private:
  friend class MotionJudge;
  std::shared_ptr<detail::MotionMemory> memory_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_MOTION_STATE_HPP
