// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cmath>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rotation.hpp"
#include "dynfilter/motion/relative_pose.hpp"

namespace dynfilter::detail {

/// Throws std::invalid_argument that names the caller for a pose with a number that is not finite,
/// or with a rotation that is none.
inline void validate(const Pose& pose, const char* caller) {
  if (!std::isfinite(cv::norm(pose.rotation) + cv::norm(pose.translation))) {
    throw_misuse(caller, "a pose that is not finite", "a finite rotation and translation");
  }
  if (is_rotation(pose.rotation)) return;
  const double error = cv::norm(pose.rotation.t() * pose.rotation - cv::Matx33d::eye());
  throw_misuse(caller, concatenate("a rotation that is ", error, " from an orthonormal matrix"),
               "an orthonormal matrix of determinant 1");
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
