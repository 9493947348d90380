// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// The first and the last pixel of a rectangle, both included. Boxes and masks come from anywhere
/// and grow: ends beyond the range of int are moved to its ends, where no other pixel lies.
struct PixelBounds {
  int first_x, last_x, first_y, last_y;

  bool empty() const { return first_x > last_x || first_y > last_y; }

  /// Whether bounds that are not empty hold a pixel; numbers below the first wrap to great ones.
  bool contains(int x, int y) const {
    const auto beyond = [](int coordinate, int first) {
      return static_cast<unsigned>(coordinate) - static_cast<unsigned>(first);
    };
    const int is_in_columns = beyond(x, first_x) <= beyond(last_x, first_x);
    const int is_in_rows = beyond(y, first_y) <= beyond(last_y, first_y);
    return (is_in_columns & is_in_rows) != 0;
  }
};

/// Returns the rectangle, grown by `margin` pixels on each side.
inline PixelBounds bounds_of(const cv::Rect& rectangle, std::int64_t margin = 0) {
  const auto clamped = [](std::int64_t coordinate) {
    return static_cast<int>(std::clamp<std::int64_t>(coordinate, std::numeric_limits<int>::min(),
                                                     std::numeric_limits<int>::max()));
  };
  const std::int64_t x = rectangle.x, y = rectangle.y;
  const std::int64_t end_x = x + rectangle.width + margin, end_y = y + rectangle.height + margin;
  if (x - margin >= end_x || y - margin >= end_y) return {0, -1, 0, -1};
  return {clamped(x - margin), clamped(end_x - 1), clamped(y - margin), clamped(end_y - 1)};
}

/// Returns the part of a grown rectangle that lies in an image of this size; empty (0x0 at 0,0) if
/// there is none. The rectangle grows by `sideways` pixels to the left and right and by `upwards`
/// pixels to the top and bottom. Computes in 64 bits, unlike cv::Rect's operator&, because boxes
/// may lie anywhere.
inline cv::Rect clip_grown(const cv::Rect& rectangle, std::int64_t sideways, std::int64_t upwards,
                           const cv::Size& image) {
  const auto interval = [](std::int64_t first, std::int64_t length, std::int64_t limit) {
    const std::int64_t begin = std::clamp<std::int64_t>(first, 0, limit);
    const std::int64_t end = std::clamp<std::int64_t>(first + length, begin, limit);
    return std::make_pair(static_cast<int>(begin), static_cast<int>(end - begin));
  };
  const auto [x, width] =
      interval(rectangle.x - sideways, rectangle.width + 2 * sideways, image.width);
  const auto [y, height] =
      interval(rectangle.y - upwards, rectangle.height + 2 * upwards, image.height);
  return width > 0 && height > 0 ? cv::Rect(x, y, width, height) : cv::Rect();
}

/// Returns the part of a rectangle that lies in an image of this size.
inline cv::Rect clip(const cv::Rect& rectangle, const cv::Size& image) {
  return clip_grown(rectangle, 0, 0, image);
}

/// Returns the intersection of two boxes over their union; 0 if they do not meet.
inline double intersection_over_union(const cv::Rect2d& a, const cv::Rect2d& b) {
  const double both = (a & b).area();
  return both > 0 ? both / (a.area() + b.area() - both) : 0;
}

/// Returns a - b, modulo 2^32 if the difference does not fit into int.
inline cv::Point wrapping_difference(cv::Point a, cv::Point b) {
  const auto difference = [](int minuend, int subtrahend) {
    return static_cast<int>(static_cast<std::uint32_t>(minuend) -
                            static_cast<std::uint32_t>(subtrahend));
  };
  return {difference(a.x, b.x), difference(a.y, b.y)};
}

}  // namespace dynfilter::detail
