// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_NEARNESS_HPP
#define DYNFILTER_OBJECT_NEARNESS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

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

/// How far object_nearness looks in an image of this size, in steps.
inline int steps_of_reach(double reach_px, const cv::Size& image) {
  return std::max(1, static_cast<int>(std::lround(reach_px * pixel_scale(image))));
}

/// What is seen from a pixel in the eight directions: the first depth on each, 0 where there is
/// none, and what its vote counts. All objects that are asked about see the same.
struct DepthsAround {
  std::array<double, 8> metres{};
  std::array<double, 8> votes{};
  double nearest_m = std::numeric_limits<double>::infinity();  ///< of those that there are
};

/// The eight directions, clockwise from the upper left.
constexpr std::array<int, 8> columns_ahead = {-1, 0, 1, 1, 1, 0, -1, -1};
constexpr std::array<int, 8> rows_ahead = {-1, -1, -1, 0, 1, 1, 1, 0};

/// How many steps each way stay in the image, `reach` at most.
inline std::array<int, 8> steps_around(cv::Point pixel, const cv::Size& size, int reach) {
  std::array<int, 8> steps;
  steps.fill(reach);
  const bool all_inside = pixel.x >= reach && pixel.y >= reach && pixel.x < size.width - reach &&
                          pixel.y < size.height - reach;
  if (all_inside) return steps;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    steps[k] = std::min(steps_inside(pixel.x, columns_ahead[k], size.width, reach),
                        steps_inside(pixel.y, rows_ahead[k], size.height, reach));
  }
  return steps;
}

/// The pixel must lie in the image.
template <class Depth>
DepthsAround depths_around(const DepthImage<Depth>& image, cv::Point pixel, int reach) {
  const std::array<int, 8> most = steps_around(pixel, image.size(), reach);
  const Depth* const centre = image.at(pixel.x, pixel.y);
  std::array<Depth, 8> first{};
  std::array<int, 8> steps;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const std::ptrdiff_t offset = rows_ahead[k] * image.row_step() + columns_ahead[k];
    int step = 1;
    while (step <= most[k] && !image.is_depth(centre[step * offset])) ++step;
    if (step <= most[k]) first[k] = centre[step * offset];
    steps[k] = step;
  }
  DepthsAround around;
  const double scale = pixel_scale(image.size());
  for (std::size_t k = 0; k < steps.size(); ++k) around.metres[k] = image.metres_of(first[k]);
  for (std::size_t k = 0; k < steps.size(); ++k) around.votes[k] = scale / steps[k];
  for (const double metres : around.metres) {
    const double known = metres > 0 ? metres : around.nearest_m;  // nobody foresees holes
    around.nearest_m = std::min(around.nearest_m, known);
  }
  return around;
}

/// Without branches on depths, but the sum is in the order of the directions: its last bits are
/// those of the scores.
inline double object_nearness(const DepthsAround& around, const ObjectDepth& object) {
  // Most pixels beside an object have nothing but background round them.
  if (around.nearest_m > object.hull_m().upper) return 0;
  const ObjectDepth depth = object;  // a copy, which the writing of votes cannot change
  std::array<double, 8> votes;
  for (std::size_t k = 0; k < votes.size(); ++k) {
    votes[k] = depth.contains(around.metres[k]) ? around.votes[k] : 0.0;
  }
  double nearness = 0;
  for (const double vote : votes) nearness += vote;
  return nearness;
}

/// One pixel, asked by any number of objects: what lies round it is read when the first one wants
/// to know, and once. The pixel must lie in the image.
template <class Depth>
class LocalDepth {
 public:
  LocalDepth(const DepthImage<Depth>& image, cv::Point pixel, int reach)
      : image_(image), pixel_(pixel), reach_(reach), metres_(image.metres(pixel.x, pixel.y)) {}

  cv::Point pixel() const { return pixel_; }

  /// Of the pixel itself, 0 for "no depth".
  double metres() const { return metres_; }

  double nearness(const ObjectDepth& object) {
    if (!around_) around_ = depths_around(image_, pixel_, reach_);
    return object_nearness(*around_, object);
  }

 private:
  const DepthImage<Depth>& image_;
  cv::Point pixel_;
  int reach_;
  double metres_;
  std::optional<DepthsAround> around_;
};

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
    const int reach = detail::steps_of_reach(reach_px, image.size());
    nearness = detail::object_nearness(detail::depths_around(image, pixel, reach), object);
  });
  return nearness;
}

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_NEARNESS_HPP
