// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_NEARNESS_HPP
#define DYNFILTER_OBJECT_NEARNESS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/object_depth.hpp"

namespace dynfilter {
namespace detail {

/// The pixel must lie in the image.
template <class Depth>
double object_nearness(const DepthImage<Depth>& image, cv::Point pixel, const ObjectDepth& object,
                       double reach_px) {
  struct Step {
    int x, y;
  };
  constexpr std::array<Step, 8> directions = {
      {{-1, -1}, {0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}}};
  const double scale = pixel_scale(image.size());
  const int steps = std::max(1, static_cast<int>(std::lround(reach_px * scale)));
  double nearness = 0;
  for (const Step& direction : directions) {
    for (int step = 1; step <= steps; ++step) {
      const int x = pixel.x + step * direction.x, y = pixel.y + step * direction.y;
      if (!image.contains(x, y)) break;
      const double depth_m = image.metres(x, y);
      if (depth_m == 0) continue;
      if (object.contains(depth_m)) nearness += scale / step;
      break;
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
