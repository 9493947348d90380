// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_MOTION_FILTER_HPP
#define DYNFILTER_MOTION_MOTION_FILTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/motion/motion_judge.hpp"

namespace dynfilter {

/// Options of MotionFilter, by stage.
struct MotionFilterOptions {
  DynamicFilterOptions filter;  ///< for masks, depth and the floor
  /// For what really moves. Its stale_age_s is that of the compensator's options for depth.
  MotionJudgeOptions motion;
};

namespace detail {

/// Returns the options of the judge, whose masks are as stale as those of the compensator.
inline MotionJudgeOptions motion_of(const MotionFilterOptions& options) {
  MotionJudgeOptions motion = options.motion;
  motion.stale_age_s = options.filter.compensator.depth.stale_age_s;
  return motion;
}

}  // namespace detail

/// DynamicFilter with motion evidence: masks and depth say what may be dynamic, motion says what
/// is.
///
///     dynfilter::MotionState state;  // one for each camera
///     const dynfilter::MotionFilter filter(camera, state);
///     filter.apply(frame, masks, keypoints, labels, workspace);  // every frame, in order
///
/// The filter is immutable; what it knows of earlier frames is in the state. Frames need an image,
/// a time that grows, and depth or a trusted MotionState::expect_motion.
class MotionFilter : public Pipeline<MaskCuller, Compensator, MotionJudge, FeatureFloor> {
 public:
  /// Takes camera, state and options. Throws std::invalid_argument for what one of the stages
  /// refuses.
  MotionFilter(const PinholeCamera& camera, MotionState& state,
               const MotionFilterOptions& options = {})
      : Pipeline(MaskCuller(options.filter.mask_culler), Compensator(options.filter.compensator),
                 MotionJudge(camera, state, detail::motion_of(options)),
                 FeatureFloor(options.filter.feature_floor)) {}
};

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_MOTION_FILTER_HPP
