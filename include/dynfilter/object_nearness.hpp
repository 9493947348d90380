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
#include "dynfilter/detail/object_pixels.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/object_depth.hpp"

namespace dynfilter {
namespace detail {

/// How far object_nearness looks in an image of this size, in steps.
inline int steps_of_reach(double reach_px, const cv::Size& image) {
  return std::max(1, static_cast<int>(std::lround(reach_px * pixel_scale(image))));
}

/// Sums the votes of the eight directions, clockwise from the upper left: in each, the first pixel
/// votes that has depth or lies on the mask. The pixel must lie in the depth image, and `object` be
/// made for the frame. The mask shows at `pixel` - `to_depth` what the depth image shows at
/// `pixel`; there may be none.
template <class Depth>
double object_nearness(const FrameView& frame, cv::Point pixel, const ObjectPixels& object,
                       int reach, const Instance* mask, cv::Point to_depth) {
  const cv::Size size = frame.depth.size();
  const int left = std::min(reach, pixel.x), right = std::min(reach, size.width - 1 - pixel.x);
  const int up = std::min(reach, pixel.y), down = std::min(reach, size.height - 1 - pixel.y);
  struct Direction {
    int x, y, steps;  // a step, and their number as far as the border
  };
  const Direction directions[8] = {
      {-1, -1, std::min(left, up)},  {0, -1, up},  {1, -1, std::min(right, up)},  {1, 0, right},
      {1, 1, std::min(right, down)}, {0, 1, down}, {-1, 1, std::min(left, down)}, {-1, 0, left}};
  const auto row_step = static_cast<std::ptrdiff_t>(frame.depth.step1());
  const Depth* const centre = frame.depth.ptr<Depth>(pixel.y) + pixel.x;
  const double vote = pixel_scale(size);
  double nearness = 0;
  for (const auto& [x, y, steps] : directions) {
    const std::ptrdiff_t offset = y * row_step + x;
    for (int step = 1; step <= steps; ++step) {
      const Depth depth = centre[step * offset];
      const auto is_masked = [&, x = x, y = y] {
        return mask != nullptr && mask->covers(pixel - to_depth + cv::Point(step * x, step * y));
      };
      const bool is_objects = object.contain(depth) || is_masked();
      if (is_objects) nearness += (x == 0 ? 2 * vote : vote) / step;
      if (is_objects || object.has_depth(depth)) break;
    }
  }
  return nearness;
}

inline double object_nearness(const FrameView& frame, cv::Point pixel, const ObjectPixels& object,
                              int reach, const Instance* mask = nullptr, cv::Point to_depth = {}) {
  return frame.depth.type() == CV_16UC1
             ? object_nearness<std::uint16_t>(frame, pixel, object, reach, mask, to_depth)
             : object_nearness<float>(frame, pixel, object, reach, mask, to_depth);
}

}  // namespace detail

/// Measures how much of an object surrounds a pixel. It takes the place of the paper's D-LBP
/// (section 3.2): it looks at more distant neighbours, compares their depths with the object's and
/// not with the pixel's own, and makes no code.
///
/// In each of the eight directions, the first pixel with depth, up to `reach_px` away, votes for
/// the object if its depth is one of the object's. A pixel of `mask`, the object's own mask, votes
/// for the object whatever its depth; nullptr if there is none, or if it is stale. The vote counts
/// 1 / its distance (in steps, scaled to a width of 640 pixels). Votes above and below count twice,
/// because the shadow that a depth sensor throws lies to the left or right of an object. The result
/// is 0 if no direction meets the object and 10 in the midst of it. From about 0.55 on, the object
/// is the likelier owner of a pixel whose own depth is missing or the background's.
///
/// The neighbours of D-LBP are one pixel away. There, depth differs by little more than the
/// sensor's noise, and where masks fail, depth is often missing, or shifted by some pixels against
/// colour.
///
/// Throws std::invalid_argument for a malformed frame or one without depth, a pixel outside it, and
/// a mask that is not CV_8UC1, and a reach that is not above 0 and at most 1000. O(reach_px).
inline double object_nearness(const FrameView& frame, cv::Point pixel, const ObjectDepth& object,
                              double reach_px = 12, const Instance* mask = nullptr) {
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
  if (mask != nullptr && !mask->mask.empty() &&
      (mask->mask.dims != 2 || mask->mask.type() != CV_8UC1)) {
    detail::throw_misuse("object_nearness", "a mask of another type", "a mask of type CV_8UC1");
  }
  const int reach = detail::steps_of_reach(reach_px, frame.depth.size());
  const detail::ObjectPixels pixels(frame, object.mask_range_m, object.box_range_m);
  return detail::object_nearness(frame, pixel, pixels, reach, mask);
}

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_NEARNESS_HPP
