// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/statistics.hpp"

#include <cstddef>

#include <gtest/gtest.h>

namespace dynfilter {
namespace {

/// Returns the statistics of a frame of 1000 features that motion judged.
FrameStatistics judged() {
  FrameStatistics statistics;
  statistics.features = 1000;
  statistics.motion.outcome = MotionOutcome::applied;
  return statistics;
}

InstanceStatistics instance(InstanceVerdict verdict, std::size_t masked, std::size_t compensated) {
  InstanceStatistics of_instance;
  of_instance.verdict = verdict;
  of_instance.masked = masked;
  of_instance.compensated = compensated;
  return of_instance;
}

TEST(IsMotionDecided, IfItWasJudgedAndNobodyIsThere) {
  EXPECT_TRUE(judged().is_motion_decided());
  EXPECT_FALSE(FrameStatistics().is_motion_decided());
  for (const MotionOutcome outcome :
       {MotionOutcome::not_run, MotionOutcome::no_image, MotionOutcome::started,
        MotionOutcome::repeated, MotionOutcome::too_few_tracks, MotionOutcome::pose_not_trusted}) {
    FrameStatistics statistics = judged();
    statistics.motion.outcome = outcome;
    EXPECT_FALSE(statistics.is_motion_decided()) << static_cast<int>(outcome);
  }
}

TEST(IsMotionDecided, IfEachObjectThatMattersHasAVerdict) {
  FrameStatistics statistics = judged();
  statistics.instances = {
      instance(InstanceVerdict::moving, 200, 0), instance(InstanceVerdict::still, 0, 200),
      instance(InstanceVerdict::undecided, 30, 20), instance(InstanceVerdict::not_judged, 0, 0)};
  EXPECT_TRUE(statistics.is_motion_decided());
  statistics.instances[2].compensated = 21;
  EXPECT_FALSE(statistics.is_motion_decided());
  statistics.instances[2].verdict = InstanceVerdict::still;
  EXPECT_TRUE(statistics.is_motion_decided());
  statistics.instances[3].masked = 51;
  EXPECT_FALSE(statistics.is_motion_decided());
}

}  // namespace
}  // namespace dynfilter
