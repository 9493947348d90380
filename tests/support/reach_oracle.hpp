// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracle of the place where an object may be, written as plainly as possible.

#ifndef DYNFILTER_TESTS_SUPPORT_REACH_ORACLE_HPP
#define DYNFILTER_TESTS_SUPPORT_REACH_ORACLE_HPP

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>

#include "support/oracle.hpp"

namespace dynfilter::testing {

/// Age of the masks, seconds.
inline double oracle_age(const FilterCase& input) {
  const double age = std::abs(input.frame.timestamp_s - input.segmentation.timestamp_s);
  return age > depth_rule::max_age_s ? 0 : age;
}

/// Tells whether the pixel lies in the image and in the box, grown by its margin and by the
/// object's possible motion.
inline bool oracle_in_reach(const FilterCase& input, const cv::Rect& box, WidePoint pixel) {
  const DepthCompensatorOptions& options = input.options.compensator.depth;
  const cv::Size size = input.segmentation.image_size;
  const double scale = size.width / 640.0;
  const double moved = options.motion_px_per_s * oracle_age(input);
  const double longest_side = std::max(size.width, size.height);
  const double dx = std::min(longest_side, (depth_rule::box_margin_px + moved) * scale);
  const double dy = std::min(longest_side, (depth_rule::box_margin_px + moved / 2) * scale);
  const auto holds = [](double first, double length, double margin, double value) {
    margin = std::round(margin);
    return length + 2 * margin > 0 && value >= first - margin && value < first + length + margin;
  };
  return pixel.x >= 0 && pixel.y >= 0 && pixel.x < size.width && pixel.y < size.height &&
         holds(box.x, box.width, dx, pixel.x) && holds(box.y, box.height, dy, pixel.y);
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_REACH_ORACLE_HPP
