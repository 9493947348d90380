// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <functional>
#include <memory>

#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/motion/motion_judge.hpp"

namespace dynfilter {

/// Options of MotionFilter, by stage.
struct MotionFilterOptions {
  DynamicFilterOptions filter;  ///< for masks, depth and the floor
  MotionJudgeOptions motion;    ///< for what really moves
};

/// DynamicFilter with one more stage, MotionJudge, for frames in order with depth and a camera:
/// masks and depth say what may be dynamic, motion says what is.
///
///     dynfilter::MotionFilter filter(camera);  // one for each camera
///     filter.apply(frame, masks, keypoints, labels, workspace);  // every frame, in order
///
/// It remembers earlier frames, so one thread at a time. Frames need an image, a time that grows,
/// and depth or a trusted MotionJudge::expect_motion.
class MotionFilter {
 public:
  /// Takes camera and options. Throws std::invalid_argument for what one of the stages refuses.
  explicit MotionFilter(const Camera& camera, const MotionFilterOptions& options = {})
      : judge_(std::make_unique<MotionJudge>(camera, options.motion,
                                             options.filter.compensator.depth.stale_age_s)),
        pipeline_(MaskCuller(options.filter.mask_culler), Compensator(options.filter.compensator),
                  std::ref(*judge_), FeatureFloor(options.filter.feature_floor)) {}

  /// Labels the frame's features, as Pipeline::apply.
  void apply(const FrameView& frame, SegmentationView segmentation, FeaturesView features,
             FeatureLabels& labels, Workspace& workspace) {
    pipeline_.apply(frame, segmentation, features, labels, workspace);
  }

  /// Returns the stage that judges motion, to hand over what the host knows.
  MotionJudge& judge() { return *judge_; }

 private:
  std::unique_ptr<MotionJudge> judge_;  // where it stays when the filter moves
  Pipeline<MaskCuller, Compensator, std::reference_wrapper<MotionJudge>, FeatureFloor> pipeline_;
};

}  // namespace dynfilter
