// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_filter.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Class of a host that holds a filter.
struct Tracker {
  Tracker() : filter(camera()) {}

  FeatureLabels see(const Shot& shot) {
    FeatureLabels labels;
    filter.apply(shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints, labels,
                 workspace);
    return labels;
  }

  MotionFilter filter;
  Workspace workspace;
};

TEST(MotionFilter, MayBeMoved) {
  Tracker resting;
  std::vector<Tracker> moved(1);
  for (std::size_t i = 0; i < 7; ++i) {
    if (i == 2) moved.reserve(moved.capacity() + 1);  // moves what it holds
    if (i == 4) {
      Tracker other;
      other = std::move(moved[0]);
      moved[0] = std::move(other);
    }
    EXPECT_TRUE(are_equal(moved[0].see(shots(0)[i]), resting.see(shots(0)[i]))) << i;
  }
  const InstanceVerdict verdict = resting.see(shots(0)[7]).statistics().instances[0].verdict;
  EXPECT_EQ(verdict, InstanceVerdict::still) << "the filters had something to remember";
}

TEST(MotionFilter, IsLikeNewAfterAReset) {
  Tracker used, fresh;
  for (std::size_t i = 0; i < 5; ++i) used.see(shots(0.5)[i]);
  used.filter.judge().reset();
  for (std::size_t i = 5; i < 9; ++i) {
    EXPECT_TRUE(are_equal(used.see(shots(0.5)[i]), fresh.see(shots(0.5)[i]))) << i;
  }
}

/// Returns the index of the first frame in which motion is decided; none if it never is. The masks
/// begin at a frame.
std::optional<std::size_t> first_decided(double speed_m_s, std::size_t first_masks) {
  MotionFilter filter(camera());
  Workspace workspace;
  FeatureLabels labels;
  for (std::size_t i = 0; i < frames; ++i) {
    const Shot& shot = shots(speed_m_s)[i];
    std::optional<Segmentation> masks;
    if (i >= first_masks) masks = shot.rendered.true_segmentation;
    filter.apply(shot.rendered.frame, masks, shot.keypoints, labels, workspace);
    if (labels.statistics().is_motion_decided()) return i;
  }
  return {};
}

TEST(MotionDecided, WherePeopleAreStillOrMoveInSomeFrames) {
  const auto still = first_decided(0, 0), walking = first_decided(0.5, 0);
  ASSERT_TRUE(still && walking);
  const auto still_frames = static_cast<std::size_t>(MotionJudgeOptions().still_frames);
  EXPECT_GE(*still, still_frames + 3) << "one frame that is not quiet must not change it";
  EXPECT_LE(*still, 10U);
  EXPECT_GE(*walking, 3U);
  EXPECT_LE(*walking, 5U);
}

/// Before the first masks, nobody knows that people stand there.
TEST(MotionDecided, NeverBeforeTheFirstMasks) {
  EXPECT_EQ(first_decided(0, frames), std::nullopt);
  const auto late = first_decided(0, 4);
  ASSERT_TRUE(late);
  EXPECT_GE(*late, 4U + static_cast<std::size_t>(MotionJudgeOptions().still_frames) - 1);
}

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
      if (by_sure[i].reason != Reason::still) continue;
      EXPECT_FLOAT_EQ(by_doubtful[i].score, 0.5F * by_sure[i].score);
      restored += by_sure[i].score > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(restored, 100U);
}

}  // namespace
}  // namespace dynfilter::testing
