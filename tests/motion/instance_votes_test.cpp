// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/instance_votes.hpp"

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/dynfilter.hpp"
#include "motion/motion_measurement.hpp"

namespace dynfilter::detail {
namespace {

constexpr std::size_t members = 40;

/// Shifts of all members over one and three frames, pixels.
struct Shifts {
  float short_px, long_px;
};

/// Returns measured motions of members of instance 1 that are 2 m away, thirty frames a second.
MotionMeasurement measured_at(const Shifts& shifts, std::size_t tracked = members) {
  MotionMeasurement measured;
  for (std::size_t b = 0; b < motion_baseline_frames.size(); ++b) {
    measured.baselines[b].is_used = true;
    measured.baselines[b].duration_s = motion_baseline_frames[b] / 30.0;
  }
  measured.motions.resize(members);
  measured.depths.assign(members, {2, 2});
  for (std::size_t i = 0; i < tracked; ++i) {
    FeatureMotion& motion = measured.motions[i];
    motion.is_tracked = {true, true};
    motion.shift_px = {cv::Vec2f(shifts.short_px, 0), cv::Vec2f(shifts.long_px, 0)};
  }
  return measured;
}

/// Returns the votes of instance 1, beside a feature of another instance.
InstanceVotes voted(MotionMeasurement measured, const MotionJudgeOptions& options = {}) {
  const PinholeCamera camera{400, 400, 320, 240};
  const std::vector<cv::KeyPoint> keypoints(members + 1);
  const FrameView frame;
  const Segmentation masks;
  const FilterInput input{frame, masks, keypoints};
  MotionMemory memory;
  Workspace workspace;
  FeatureLabels labels(keypoints.size(), {});
  labels.statistics().instances.resize(2);
  for (std::size_t i = 0; i < members; ++i) labels.remove(i, 1, Reason::in_mask, 1);
  labels.remove(members, 0, Reason::in_mask, 1);  // another instance's
  measured.motions.emplace_back();
  measured.motions.back().is_tracked = {true, true};
  measured.motions.back().ratio = 100;
  measured.depths.emplace_back();
  const MotionContext context{input, camera, options, true, memory, measured, workspace};
  return votes_of(context, labels, 1);
}

TEST(InstanceVotes, AreQuietWhereMostMembersAreStatic) {
  const MotionMeasurement still = measured_at({0.2F, 0.4F});
  const InstanceVotes votes = voted(still);
  EXPECT_EQ(votes.members, members);
  EXPECT_EQ(votes.tracked, members);
  EXPECT_EQ(votes.moving, 0U);
  EXPECT_TRUE(votes.is_quiet);
  EXPECT_TRUE(votes.is_complete);
  EXPECT_TRUE(voted(measured_at({0.1F, 0.7F})).is_complete) << "tracks are not that exact";

  MotionMeasurement partly = still;
  for (std::size_t i = 0; i < members / 4; ++i) partly.motions[i].shift_px[0] = {5, 0};
  EXPECT_TRUE(voted(partly).is_quiet);
  for (std::size_t i = 0; i < members / 2; ++i) partly.motions[i].shift_px[0] = {5, 0};
  EXPECT_FALSE(voted(partly).is_quiet);

  MotionMeasurement nearer = still;
  for (std::size_t i = 0; i < members / 2; ++i) nearer.motions[i].approach_m = 0.1F;
  EXPECT_FALSE(voted(nearer).is_quiet);
}

TEST(InstanceVotes, AreNotQuietWhereTheLongBaselineSeesASlowShift) {
  EXPECT_FALSE(voted(measured_at({0.7F, 2.1F})).is_quiet);  // 0.1 m/s
  EXPECT_FALSE(voted(measured_at({3, 9})).is_quiet);
  EXPECT_TRUE(voted(measured_at({0.7F, 2.1F})).is_complete);
}

TEST(InstanceVotes, CountTheMembersThatMove) {
  MotionMeasurement measured = measured_at({0.2F, 0.4F}, members - 4);
  for (std::size_t i = 0; i < 5; ++i) {
    measured.motions[i].ratio = 1.5F;
    measured.motions[i].baseline = i % 2;
  }
  const InstanceVotes votes = voted(measured);
  EXPECT_EQ(votes.members, members);
  EXPECT_EQ(votes.tracked, members - 4);
  EXPECT_EQ(votes.moving, 5U);
}

TEST(InstanceVotes, AreNotQuietWithoutTheShortBaseline) {
  MotionMeasurement measured = measured_at({0.2F, 0.4F});
  measured.baselines[1].is_used = false;
  EXPECT_TRUE(voted(measured).is_quiet);
  EXPECT_FALSE(voted(measured).is_complete);
  measured.baselines[1].is_used = true;
  for (FeatureMotion& motion : measured.motions) motion.is_tracked[0] = false;
  EXPECT_FALSE(voted(measured).is_quiet);
  EXPECT_FALSE(voted(measured).is_complete);
}

}  // namespace
}  // namespace dynfilter::detail
