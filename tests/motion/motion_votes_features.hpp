// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features for the tests of the votes on motion.

#ifndef DYNFILTER_TESTS_MOTION_VOTES_FEATURES_HPP
#define DYNFILTER_TESTS_MOTION_VOTES_FEATURES_HPP

#include <vector>

#include "dynfilter/motion/motion_votes.hpp"

namespace dynfilter {

inline FeatureMotion motion_of(MotionEvidence evidence, cv::Vec2f shift_px = {}) {
  FeatureMotion motion;
  motion.evidence = evidence;
  motion.shift_px[0] = shift_px;
  motion.is_tracked[0] = evidence != MotionEvidence::unknown;
  return motion;
}

inline FrameFeatures features_at(const std::vector<cv::Point2f>& points) {
  FrameFeatures features;
  features.read(points);
  return features;
}

}  // namespace dynfilter

#endif  // DYNFILTER_TESTS_MOTION_VOTES_FEATURES_HPP
