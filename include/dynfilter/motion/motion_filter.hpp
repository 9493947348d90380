// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_MOTION_FILTER_HPP
#define DYNFILTER_MOTION_MOTION_FILTER_HPP

#include <memory>

#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/motion/motion_judge.hpp"

namespace dynfilter {

/// Options of MotionFilter, by stage.
struct MotionFilterOptions {
  DynamicFilterOptions filter;  ///< for masks, depth and the floor
  /// For what really moves. Its stale_age_s is that of the compensator's options for depth.
  MotionJudgeOptions motion;
};

/// DynamicFilter with motion evidence: masks and depth say what may be dynamic, motion says what
/// is.
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
      : judge_(std::make_unique<MotionJudge>(camera, motion_of(options))),
        pipeline_(MaskCuller(options.filter.mask_culler), Compensator(options.filter.compensator),
                  Judging{judge_.get()}, FeatureFloor(options.filter.feature_floor)) {}

  /// Labels the frame's features, as Pipeline::apply.
  void apply(const FrameView& frame, SegmentationView segmentation, FeaturesView features,
             FeatureLabels& labels, Workspace& workspace) {
    pipeline_.apply(frame, segmentation, features, labels, workspace);
  }

  /// Returns the stage that judges motion, to hand over what the host knows.
  MotionJudge& judge() { return *judge_; }

 private:
  /// The judge as a stage, which may change it.
  struct Judging {
    MotionJudge* judge;

    void check(const FilterInput& input) const { judge->check(input); }
    void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
      (*judge)(input, labels, workspace);
    }
  };

  /// Returns the options of the judge, whose masks are as stale as those of the compensator.
  static MotionJudgeOptions motion_of(const MotionFilterOptions& options) {
    MotionJudgeOptions motion = options.motion;
    motion.stale_age_s = options.filter.compensator.depth.stale_age_s;
    return motion;
  }

  std::unique_ptr<MotionJudge> judge_;  // where it stays when the filter moves
  Pipeline<MaskCuller, Compensator, Judging, FeatureFloor> pipeline_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_MOTION_FILTER_HPP
