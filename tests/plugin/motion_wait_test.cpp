// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/motion_wait.hpp"

#include <cstddef>
#include <string>

#include <gtest/gtest.h>

namespace dynfilter::detail {
namespace {

/// Returns the labels of a frame of which one feature is removed, with motion judged or not.
FeatureLabels labels_of(MotionOutcome outcome) {
  FeatureLabels labels(10, {});
  labels.remove(0, -1, Reason::in_mask, 1.0F);
  labels.remove(1, -1, Reason::in_mask, 1.0F);
  labels.restore(1, 0.25F);
  labels.statistics().has_segmentation = true;
  labels.statistics().motion.outcome = outcome;
  return labels;
}

/// Returns the number of features that the wait leaves of such a frame.
std::size_t kept(MotionWait& wait, MotionOutcome outcome, const std::string& sentence = "") {
  FeatureLabels labels = labels_of(outcome);
  EXPECT_EQ(wait.hold(labels), sentence);
  EXPECT_EQ(labels.statistics().custom, wait.holds() ? 9U : 0U);
  EXPECT_EQ(labels[1].score, 0.25F) << "the host may still want the most static one";
  return labels.statistics().kept();
}

TEST(MotionWait, TakesAllFeaturesUntilMotionIsDecidedForTheFirstTime) {
  MotionWait wait(5, "key");
  EXPECT_EQ(kept(wait, MotionOutcome::started), 0U);
  EXPECT_EQ(kept(wait, MotionOutcome::too_few_tracks), 0U);
  EXPECT_TRUE(wait.holds());
  EXPECT_EQ(kept(wait, MotionOutcome::applied), 9U);
  EXPECT_FALSE(wait.holds());
  EXPECT_EQ(kept(wait, MotionOutcome::started), 9U) << "a cut does not end the host's map";
}

TEST(MotionWait, EndsAfterItsFramesAndSaysSo) {
  MotionWait wait(3, "wait_for_motion in TUM3.yaml");
  EXPECT_EQ(kept(wait, MotionOutcome::started), 0U);
  EXPECT_EQ(kept(wait, MotionOutcome::pose_not_trusted), 0U);
  EXPECT_EQ(kept(wait, MotionOutcome::pose_not_trusted,
                 "dynfilter: motion was not decided in the first 3 frames, the most that "
                 "wait_for_motion in TUM3.yaml allows: the host may begin its map in the next "
                 "one, without what still persons cover"),
            0U);
  EXPECT_EQ(kept(wait, MotionOutcome::pose_not_trusted), 9U);
}

TEST(MotionWait, SaysThatItNeedsMasks) {
  MotionWait wait(1, "wait_for_motion in TUM3.yaml");
  FeatureLabels labels = labels_of(MotionOutcome::applied);
  labels.statistics().has_segmentation = false;
  EXPECT_EQ(wait.hold(labels),
            "dynfilter: motion was not decided in the first 1 frame, the most that "
            "wait_for_motion in TUM3.yaml allows, because none of them had masks, which it needs: "
            "the host may begin its map in the next one, without what still persons cover");
}

TEST(MotionWait, OfNoFramesTakesNothing) {
  MotionWait wait(0, "key");
  EXPECT_EQ(kept(wait, MotionOutcome::started), 9U);
}

}  // namespace
}  // namespace dynfilter::detail
