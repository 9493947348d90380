// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features between others that move.

#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_judge.hpp"
#include "motion/motion_labels.hpp"
#include "motion/motion_measurement.hpp"

namespace dynfilter::detail {
namespace {

/// Tells whether a feature becomes dynamic that has 24 features around it, so many of which are
/// believed to move.
bool is_filled(const FeatureMotion& motion, int dynamic_around) {
  const PinholeCamera camera{400, 400, 160, 120};
  std::vector<cv::KeyPoint> keypoints = {{160, 120, 7}};
  std::vector<FeatureMotion> motions = {motion};
  MotionMeasurement measured;
  measured.beliefs = {0};
  for (int i = 0; i < 25; ++i) {
    if (i == 12) continue;
    const bool moves = static_cast<int>(motions.size()) <= dynamic_around;
    keypoints.emplace_back(cv::Point2f(cv::Point(150 + 5 * (i % 5), 110 + 5 * (i / 5))), 7.0F);
    FeatureMotion other;
    other.is_tracked[0] = true;
    other.evidence = moves ? MotionEvidence::supported : MotionEvidence::quiet;
    motions.push_back(other);
    measured.beliefs.push_back(moves ? 10 : -10);
  }
  measured.motions = motions;
  FrameView frame;
  frame.image = cv::Mat1b(240, 320, std::uint8_t{0});
  const FilterInput input{frame, {}, keypoints};
  const MotionJudgeOptions options;
  MotionMemory memory;
  memory.beliefs.emplace(options.belief);
  Workspace workspace;
  decide_features({input, camera, options, false, memory, measured, workspace});
  return measured.is_dynamic[0] != 0;
}

TEST(MotionFill, TakesUnclearFeaturesBetweenThoseThatMove) {
  FeatureMotion tracked, with_depth;
  tracked.is_tracked[0] = true;
  tracked.ratio = 0.5F;
  with_depth.depth_m = 2;
  for (const FeatureMotion& unclear : {tracked, with_depth}) {
    EXPECT_TRUE(is_filled(unclear, 24));
    EXPECT_TRUE(is_filled(unclear, 16));
    EXPECT_FALSE(is_filled(unclear, 14));
    EXPECT_FALSE(is_filled(unclear, 0));
  }
  tracked.ratio = 0.2F;  // it is where a static one would be
  EXPECT_FALSE(is_filled(tracked, 24));
  EXPECT_FALSE(is_filled(FeatureMotion(), 24));  // nothing is known of it
}

}  // namespace
}  // namespace dynfilter::detail
