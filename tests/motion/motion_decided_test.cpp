// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests of when a host should begin its map: FrameStatistics::is_motion_decided on rendered frames.

#include <cstddef>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_filter.hpp"
#include "motion/motion_labels.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Returns the index of the first frame in which motion is decided; none if it never is. The masks
/// begin at a frame.
std::optional<std::size_t> first_decided(double speed_m_s, std::size_t first_masks) {
  MotionState state;
  const MotionFilter filter(camera(), state);
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
  const InstanceMotionOptions defaults;
  EXPECT_GE(*still,
            static_cast<std::size_t>(defaults.min_still_frames + defaults.cancelled_frames));
  EXPECT_LE(*still, 10U);
  EXPECT_GE(*walking, static_cast<std::size_t>(defaults.min_moving_frames));
  EXPECT_LE(*walking, 5U);
}

/// Before the first masks, nobody knows that people stand there.
TEST(MotionDecided, NeverBeforeTheFirstMasks) {
  EXPECT_EQ(first_decided(0, frames), std::nullopt);
  const auto late = first_decided(0, 4);
  ASSERT_TRUE(late);
  EXPECT_GE(*late, 4U + static_cast<std::size_t>(InstanceMotionOptions().min_still_frames) - 1);
}

/// An object for which a twentieth of the features went hardly changes a map.
TEST(MotionDecided, CountsTheObjectsThatMatter) {
  Segmentation masks;
  masks.image_size = {640, 480};
  masks.instances.resize(3);
  const std::vector<cv::KeyPoint> keypoints(1000);
  const FrameView frame;
  const FilterInput input{frame, masks, keypoints};
  const PinholeCamera pinhole{400, 400, 320, 240};
  const MotionJudgeOptions options;
  detail::MotionMemory memory;
  memory.instances.emplace();
  memory.instances->begin_frame(masks);
  detail::MotionMeasurement measured;
  measured.motions.resize(keypoints.size());
  measured.baselines[0].is_used = true;
  Workspace workspace;
  const detail::MotionContext context{input, pinhole, options, true, memory, measured, workspace};
  FeatureLabels labels(keypoints.size(), {});
  std::vector<InstanceStatistics>& instances = labels.statistics().instances;
  instances.resize(3);
  instances[0].masked = 30;
  instances[0].compensated = 20;  // a twentieth in all
  instances[1].masked = 51;
  instances[2].compensated = 51;
  judge_instances(context, labels);
  EXPECT_EQ(labels.statistics().motion.unsettled_objects, 2U);
  for (const InstanceStatistics& instance : instances) {
    EXPECT_EQ(instance.verdict, InstanceVerdict::undecided);
  }
}

}  // namespace
}  // namespace dynfilter::testing
