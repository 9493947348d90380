// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What motion makes of masks that are missing, or whose time is unknown.

#include <algorithm>
#include <cstddef>

#include <gtest/gtest.h>

#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// "No masks" is not "nobody": who stood before a frame without masks stands after it.
TEST(MotionMasks, RemembersVerdictsOverFramesWithoutMasks) {
  Rig rig;
  for (const Shot& shot : shots(0)) {
    const std::size_t i = static_cast<std::size_t>(&shot - shots(0).data());
    if (i == 8 || i == 9 || i == 11) {
      rig.see_without_masks(shot);
      continue;
    }
    const FeatureLabels labels = rig.see(shot);
    if (i < 7) continue;
    EXPECT_EQ(labels.statistics().instances[0].verdict, InstanceVerdict::still) << i;
  }
}

/// A person who was not seen for longer than a gap may be another one.
TEST(MotionMasks, ForgetsVerdictsAfterAGapOfMasks) {
  MotionJudgeOptions options;
  options.max_gap_s = 0.09;
  Rig rig(options);
  for (std::size_t i = 0; i < 8; ++i) rig.see(shots(0)[i]);
  for (const std::size_t i : {8U, 9U}) rig.see_without_masks(shots(0)[i]);
  const FeatureLabels labels = rig.see(shots(0)[10]);
  EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::applied);
  EXPECT_EQ(labels.statistics().instances[0].verdict, InstanceVerdict::undecided);
}

/// Masks whose time was not set are not stale for motion either.
TEST(MotionMasks, TakesMasksWithoutATimeForFresh) {
  Rig rig, other;
  std::size_t moving = 0;
  for (Shot shot : shots(0.5)) {
    const FeatureLabels fresh = rig.see(shot);
    shot.rendered.true_segmentation.timestamp_s -= 1e6;
    EXPECT_TRUE(are_equal(other.see(shot), fresh));
    moving += fresh.statistics().moving;
  }
  EXPECT_GT(moving, 0U);
}

/// As the scores of the other stages, that of a feature that comes back counts the detector's
/// confidence.
TEST(MotionMasks, ConfidenceScalesTheScoresOfWhatComesBack) {
  Rig sure, doubtful;
  std::size_t restored = 0;
  for (Shot shot : shots(0)) {
    const FeatureLabels by_sure = sure.see(shot);
    for (Instance& person : shot.rendered.true_segmentation.instances) person.score *= 0.5F;
    const FeatureLabels by_doubtful = doubtful.see(shot);
    for (std::size_t i = 0; i < by_sure.size(); ++i) {
      EXPECT_EQ(by_sure[i].reason, by_doubtful[i].reason);
      if (by_sure[i].reason != Reason::restored) continue;
      EXPECT_FLOAT_EQ(by_doubtful[i].score, 0.5F * by_sure[i].score);
      restored += by_sure[i].score > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(restored, 100U);
}

/// In the last frame the camera goes as far as in eight frames before.
TEST(MotionMasks, WithoutLimitTheCameraMayMoveInAnyWay) {
  MotionJudgeOptions options;
  Rig limited(options);
  options.max_acceleration_m_s2 = 0;
  Rig free(options);
  for (const std::size_t i : {0U, 1U, 2U, 10U}) {
    Shot shot = shots(0)[i];
    shot.rendered.frame.timestamp_s =
        shots(0)[std::min<std::size_t>(i, 3)].rendered.frame.timestamp_s;
    const auto outcome = [&](Rig& rig) {
      return rig.see_without_masks(shot).statistics().motion.outcome;
    };
    const MotionOutcome expected = i == 0 ? MotionOutcome::started : MotionOutcome::applied;
    EXPECT_EQ(outcome(free), expected) << i;
    EXPECT_EQ(outcome(limited), i == 10 ? MotionOutcome::pose_not_trusted : expected) << i;
  }
}

}  // namespace
}  // namespace dynfilter::testing
