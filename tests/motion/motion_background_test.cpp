// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features of the background that a compensator removed beside a person who walks.

#include <cstddef>
#include <cstdint>

#include <gtest/gtest.h>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Returns how many of the features come back that a compensator removed 20 to 60 pixels from a
/// person who walks.
std::size_t given_back(const MotionJudgeOptions& options) {
  Rig rig(options);
  std::size_t sum = 0;
  for (const Shot& shot : shots(0.5)) {
    const FrameView& frame = shot.rendered.frame;
    const Segmentation& masks = shot.rendered.true_segmentation;
    FeatureLabels labels = Pipeline<MaskCuller>(MaskCuller()).apply(frame, masks, shot.keypoints);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::Point pixel = nearest_pixel(shot.keypoints[i].pt);
      for (std::size_t k = 0; k < masks.instances.size() && !labels.is_removed(i); ++k) {
        const Instance& person = masks.instances[k];
        if (detail::mask_within(person, pixel, 20) || !detail::mask_within(person, pixel, 60)) {
          continue;
        }
        labels.remove(i, static_cast<std::int32_t>(k), Reason::compensated, 0.6F);
      }
    }
    rig.judge({frame, masks, shot.keypoints}, labels, rig.workspace);
    sum += labels.statistics().motion.given_back;
  }
  return sum;
}

TEST(MotionBackground, ComesBackIfItHasBeenStillAtOneDepth) {
  EXPECT_GT(given_back({}), 100U);
  MotionJudgeOptions options;
  options.max_background_belief = -100;  // below all that frames can tell
  EXPECT_EQ(given_back(options), 0U);
  options = {};
  options.max_background_depth_range_m = 0;  // no depth spans less
  EXPECT_EQ(given_back(options), 0U);
}

}  // namespace
}  // namespace dynfilter::testing
