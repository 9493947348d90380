// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {

/// One frame: pixels, time and number. The matrices are headers that share their pixels, as usual
/// with cv::Mat; the library only reads them and keeps none after the call. Every member may be
/// empty; a component that needs one says so in its error.
struct FrameView {
  std::uint64_t id = 0;      ///< the host's frame number; it seeds the frame's random sample
  double timestamp_s = 0.0;  ///< time of the frame, seconds; must be finite
  cv::Mat image;             ///< 8-bit, grey or BGR
  cv::Mat depth;             ///< registered to the image: CV_16UC1, or CV_32FC1
  /// Metres per unit of `depth`; required for CV_16UC1; CV_32FC1 is in metres when it is 0.
  double metres_per_unit = 0;

  /// Returns metres per unit of `depth`: metres_per_unit, or 1 for CV_32FC1 where that is 0.
  double depth_scale() const {
    return depth.type() == CV_32FC1 && metres_per_unit == 0 ? 1.0 : metres_per_unit;
  }

  /// Returns the depth at a pixel, metres. Returns nothing without a depth image, outside it, and
  /// where the sensor measured nothing (0, negative, NaN, infinite). O(1).
  std::optional<double> depth_m(cv::Point pixel) const {
    if (pixel.x < 0 || pixel.y < 0 || pixel.x >= depth.cols || pixel.y >= depth.rows) return {};
    const unsigned char* const row = depth.data + static_cast<std::size_t>(pixel.y) * depth.step[0];
    double metres = 0;
    if (depth.type() == CV_16UC1) {
      metres = reinterpret_cast<const std::uint16_t*>(row)[pixel.x] * metres_per_unit;
    } else if (depth.type() == CV_32FC1) {
      metres = double{reinterpret_cast<const float*>(row)[pixel.x]} * depth_scale();
    }
    if (!(metres > 0) || !std::isfinite(metres)) return {};
    return metres;
  }
};

/// Checks a frame. Throws std::invalid_argument, in the name of `component`, if the time is not
/// finite, if an image has not two dimensions, if the depth image is neither CV_16UC1 with
/// metres_per_unit nor CV_32FC1, or if image and depth differ in size. O(1).
inline void validate(const FrameView& frame, const char* component) {
  if (!std::isfinite(frame.timestamp_s)) {
    detail::throw_misuse(component,
                         detail::concatenate("timestamp_s = ", frame.timestamp_s, " in the frame"),
                         "a finite time in seconds");
  }
  if (frame.image.dims > 2) {
    detail::throw_misuse(component,
                         detail::concatenate("an image of type ", detail::type_name(frame.image),
                                             " with ", frame.image.dims, " dimensions"),
                         "two dimensions");
  }
  if (frame.depth.empty()) return;
  const int type = frame.depth.type();
  if ((type != CV_16UC1 && type != CV_32FC1) || frame.depth.dims != 2) {
    detail::throw_misuse(
        component,
        detail::concatenate("a depth image of type ", detail::type_name(frame.depth), " and ",
                            frame.depth.dims, " dimensions"),
        "CV_16UC1 with metres_per_unit, or CV_32FC1 in metres");
  }
  const double scale = frame.depth_scale();
  const double most = type == CV_16UC1 ? 1 : std::numeric_limits<double>::max();
  if (!(scale > 0 && scale <= most)) {
    detail::throw_misuse(
        component,
        detail::concatenate("metres_per_unit = ", frame.metres_per_unit, " with a ",
                            detail::type_name(frame.depth), " depth"),
        "metres per depth unit, above 0, of 16 bits at most 1 (TUM and BONN: 1.0 / 5000)");
  }
  if (!frame.image.empty() && frame.image.size() != frame.depth.size()) {
    detail::throw_misuse(
        component,
        detail::concatenate("an image of ", detail::size_name(frame.image.size()),
                            " and a depth image of ", detail::size_name(frame.depth.size())),
        "depth registered to the image, of the same size");
  }
}

}  // namespace dynfilter
