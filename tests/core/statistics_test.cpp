// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/statistics.hpp"

#include <gtest/gtest.h>

namespace dynfilter {
namespace {

/// Returns the statistics of a frame with masks that motion judged.
FrameStatistics judged() {
  FrameStatistics statistics;
  statistics.has_segmentation = true;
  statistics.motion.outcome = MotionOutcome::applied;
  return statistics;
}

TEST(IsMotionDecided, IfItWasJudgedAndNoObjectIsUndecided) {
  EXPECT_TRUE(judged().is_motion_decided());
  FrameStatistics statistics = judged();
  statistics.motion.unsettled_objects = 1;
  EXPECT_FALSE(statistics.is_motion_decided());
  EXPECT_FALSE(FrameStatistics().is_motion_decided());
  for (const MotionOutcome outcome :
       {MotionOutcome::not_run, MotionOutcome::no_image, MotionOutcome::started,
        MotionOutcome::repeated, MotionOutcome::too_few_tracks, MotionOutcome::pose_not_trusted}) {
    statistics = judged();
    statistics.motion.outcome = outcome;
    EXPECT_FALSE(statistics.is_motion_decided()) << static_cast<int>(outcome);
  }
}

/// Without masks, nobody knows whether somebody stands there.
TEST(IsMotionDecided, OnlyWithMasks) {
  FrameStatistics statistics = judged();
  statistics.has_segmentation = false;
  EXPECT_FALSE(statistics.is_motion_decided());
}

}  // namespace
}  // namespace dynfilter
