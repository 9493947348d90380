// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_NEARNESS_HPP
#define DYNFILTER_OBJECT_NEARNESS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/object_depth.hpp"

namespace dynfilter {
namespace detail {

/// How many steps of -1, 0 or 1 lead from a position to the image's border, at most `reach`.
inline int steps_to_border(int position, int step, int length, int reach) {
  if (step == 0) return reach;
  return std::min(reach, step > 0 ? length - 1 - position : position);
}

/// How far object_nearness looks in an image of this size, in steps.
inline int steps_of_reach(double reach_px, const cv::Size& image) {
  return std::max(1, static_cast<int>(std::lround(reach_px * pixel_scale(image))));
}

/// Sums the votes of the eight directions, clockwise from the upper left: in each, the first pixel
/// with depth votes. The pixel must lie in the image.
template <class Depth>
double object_nearness(const FrameView& frame, cv::Point pixel, const ObjectDepth& object,
                       int reach) {
  constexpr int directions[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {1, 0},
                                    {1, 1},   {0, 1},  {-1, 1}, {-1, 0}};
  const cv::Size size = frame.depth.size();
  const auto row_step = static_cast<std::ptrdiff_t>(frame.depth.step1());
  const Depth* const centre = frame.depth.ptr<Depth>(pixel.y) + pixel.x;
  const double depth_scale = frame.depth_scale();
  const double vote = pixel_scale(size);
  double nearness = 0;
  for (const auto& [x, y] : directions) {
    const int steps = std::min(steps_to_border(pixel.x, x, size.width, reach),
                               steps_to_border(pixel.y, y, size.height, reach));
    const std::ptrdiff_t offset = y * row_step + x;
    for (int step = 1; step <= steps; ++step) {
      const double metres = static_cast<double>(centre[step * offset]) * depth_scale;
      if (!(metres > 0) || !std::isfinite(metres)) continue;
      if (object.contains(metres)) nearness += (x == 0 ? 2 * vote : vote) / step;
      break;
    }
  }
  return nearness;
}

inline double object_nearness(const FrameView& frame, cv::Point pixel, const ObjectDepth& object,
                              int reach) {
  return frame.depth.type() == CV_16UC1
             ? object_nearness<std::uint16_t>(frame, pixel, object, reach)
             : object_nearness<float>(frame, pixel, object, reach);
}

}  // namespace detail

/// Measures how much of an object surrounds a pixel. It takes the place of the paper's D-LBP
/// (section 3.2): it looks at more distant neighbours, compares their depths with the object's and
/// not with the pixel's own, and makes no code.
///
/// In each of the eight directions, the first pixel with depth, up to `reach_px` away, votes for
/// the object if its depth is one of the object's. The vote counts 1 / its distance (in steps,
/// scaled to a width of 640 pixels). Votes above and below count twice, because the shadow that a
/// depth sensor throws lies to the left or right of an object. The result is 0 if no direction
/// meets the object and 10 in the midst of it. From about 0.5 on, the object is the likelier owner
/// of a pixel whose own depth is missing or the background's.
///
/// The neighbours of D-LBP are one pixel away. There, depth differs by little more than the
/// sensor's noise, and where masks fail, depth is often missing, or shifted by some pixels against
/// colour.
///
/// Throws std::invalid_argument for a malformed frame or one without depth, a pixel outside it, and
/// a reach that is not above 0 and at most 1000. O(reach_px).
inline double object_nearness(const FrameView& frame, cv::Point pixel, const ObjectDepth& object,
                              double reach_px = 12) {
  validate(frame, "object_nearness");
  const cv::Rect whole({0, 0}, frame.depth.size());
  if (!whole.contains(pixel)) {
    detail::throw_misuse("object_nearness",
                         detail::concatenate("pixel (", pixel.x, ", ", pixel.y, ")"),
                         "a pixel inside the depth image");
  }
  if (!(reach_px > 0) || !(reach_px <= 1000)) {
    detail::throw_misuse("object_nearness", detail::concatenate("reach_px = ", reach_px),
                         "a number above 0 and at most 1000");
  }
  const int reach = detail::steps_of_reach(reach_px, frame.depth.size());
  return detail::object_nearness(frame, pixel, object, reach);
}

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_NEARNESS_HPP
