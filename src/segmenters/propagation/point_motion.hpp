// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_PROPAGATION_POINT_MOTION_HPP
#define DYNFILTER_SRC_SEGMENTERS_PROPAGATION_POINT_MOTION_HPP

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Motion of a point between two frames that follow each other.
struct PointMotion {
  cv::Point2f from;  ///< place in the earlier frame, raw pixels
  cv::Point2f to;    ///< place in the later frame, raw pixels

  /// Returns the shift from the earlier frame to the later one, pixels.
  cv::Point2f shift() const { return to - from; }
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_PROPAGATION_POINT_MOTION_HPP
