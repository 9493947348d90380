// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_NEARNESS_HPP
#define DYNFILTER_OBJECT_NEARNESS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/object_depth.hpp"

namespace dynfilter {
namespace detail {

/// How many steps of -1, 0 or 1 lead from a position to the end of the image, `most` at most.
inline int steps_inside(int position, int step, int length, int most) {
  return step == 0 ? most : std::min(most, step > 0 ? length - 1 - position : position);
}

/// How many pixels away the first pixel with depth is, along the offset of one step; 0 if there is
/// none within so many steps.
template <class Depth>
int steps_to_depth(const DepthImage<Depth>& image, const Depth* pixel, std::ptrdiff_t offset,
                   int steps) {
  for (int step = 1; step <= steps; ++step) {
    pixel += offset;
    if (image.metres_of(*pixel) != 0) return step;
  }
  return 0;
}

/// The pixel must lie in the image.
template <class Depth>
double object_nearness(const DepthImage<Depth>& image, cv::Point pixel, const ObjectDepth& object,
                       double reach_px) {
  struct Step {
    int x, y;
  };
  constexpr std::array<Step, 8> directions = {
      {{-1, -1}, {0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}}};
  const cv::Size size = image.size();
  const double scale = pixel_scale(size);
  const int reach = std::max(1, static_cast<int>(std::lround(reach_px * scale)));
  const Depth* const centre = image.at(pixel.x, pixel.y);
  double nearness = 0;
  const bool all_inside = pixel.x >= reach && pixel.y >= reach && pixel.x < size.width - reach &&
                          pixel.y < size.height - reach;
  for (const Step& direction : directions) {
    const int steps = all_inside ? reach
                                 : std::min(steps_inside(pixel.x, direction.x, size.width, reach),
                                            steps_inside(pixel.y, direction.y, size.height, reach));
    const std::ptrdiff_t offset = direction.y * image.row_step() + direction.x;
    const int step = steps_to_depth(image, centre, offset, steps);
    if (step > 0 && object.contains(image.metres_of(centre[step * offset]))) {
      nearness += scale / step;
    }
  }
  return nearness;
}

}  // namespace detail

/// How much of an object there is round a pixel: the D-LBP of the paper (section 3.2) with the
/// neighbours at a distance. In each of the eight directions the first pixel that has depth, up to
/// `reach_px` away, votes for the object if its depth is one of the object's, and the vote counts 1
/// / its distance (in steps; at a width of 640 pixels). 0 where all look past the object, 8 in the
/// midst of it, and from about 0.5 on the object is the likelier owner of a pixel whose own depth
/// is missing or the background's.
///
/// D-LBP's own neighbours, one pixel away, compare sensor noise: 29 to 57 % of a person's codes are
/// 0, and their interval spans nearly all codes. Depth is missing, or off by some pixels against
/// colour, in just the places where masks fail.
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
                         "one inside the depth image");
  }
  if (!(reach_px > 0) || !(reach_px <= 1000)) {
    detail::throw_misuse("object_nearness", detail::concatenate("reach_px = ", reach_px),
                         "above 0, at most 1000");
  }
  double nearness = 0;
  detail::with_depth_image(frame, [&](const auto& image) {
    nearness = detail::object_nearness(image, pixel, object, reach_px);
  });
  return nearness;
}

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_NEARNESS_HPP
