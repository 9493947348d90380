// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_MOTION_POSE_PRIOR_HPP
#define DYNFILTER_SRC_MOTION_POSE_PRIOR_HPP

#include <cmath>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/motion/relative_pose.hpp"

namespace dynfilter::detail {

/// Throws std::invalid_argument that names the caller for a pose with a number that is not finite.
inline void validate(const RelativePose& pose, const char* caller) {
  if (std::isfinite(cv::norm(pose.rotation) + cv::norm(pose.translation))) return;
  throw_misuse(caller, "a pose that is not finite", "a finite rotation and translation");
}

/// Throws std::invalid_argument that names the caller for such a pose, and for limits that are not
/// above 0.
inline void validate(const PosePrior& prior, const char* caller) {
  validate(prior.pose, caller);
  if (prior.max_translation_m > 0 && prior.max_rotation_rad > 0) return;
  throw_misuse(caller,
               concatenate("a prior within ", prior.max_translation_m, " m and ",
                           prior.max_rotation_rad, " rad"),
               "limits above 0");
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_POSE_PRIOR_HPP
