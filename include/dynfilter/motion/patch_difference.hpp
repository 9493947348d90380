// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_PATCH_DIFFERENCE_HPP
#define DYNFILTER_MOTION_PATCH_DIFFERENCE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <optional>

#include <opencv2/core.hpp>

namespace dynfilter {

/// Returns the mean absolute difference of brightness between two square patches, grey levels: one
/// around `at` in `image`, one around `other_at` in `other`, between whose pixels brightness is
/// interpolated linearly. Sides of 2 `reach_px` + 1. None if a patch, with a row and a column more,
/// reaches out of its image, and for a reach below 0. O(reach_px^2).
std::optional<double> patch_difference(const cv::Mat1b& image, cv::Point2f at,
                                       const cv::Mat1b& other, cv::Point2f other_at,
                                       int reach_px = 4);

/// Returns the contrast of the patch around `at`: the mean absolute difference from its mean, grey
/// levels. None as for patch_difference. O(reach_px^2).
std::optional<double> patch_contrast(const cv::Mat1b& image, cv::Point2f at, int reach_px = 4);

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_PATCH_DIFFERENCE_HPP
