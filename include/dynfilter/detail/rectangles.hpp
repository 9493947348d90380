// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_RECTANGLES_HPP
#define DYNFILTER_DETAIL_RECTANGLES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// A rectangle of pixels that may lie anywhere: in 64 bits, since boxes and masks come from
/// anywhere and grow. Left and top belong to it, right and bottom do not.
struct PixelBounds {
  std::int64_t left, top, right, bottom;

  bool empty() const { return left >= right || top >= bottom; }
  bool contains(cv::Point pixel) const {
    return ((pixel.x >= left) & (pixel.x < right) & (pixel.y >= top) & (pixel.y < bottom)) != 0;
  }
};

/// The rectangle, grown by so many pixels on each side.
inline PixelBounds bounds_of(const cv::Rect& rectangle, std::int64_t margin = 0) {
  const std::int64_t x = rectangle.x, y = rectangle.y;
  return {x - margin, y - margin, x + rectangle.width + margin, y + rectangle.height + margin};
}

/// The part of a rectangle, grown by so many pixels on either side, that lies in an image of this
/// size; empty (0x0 at 0,0) if there is none. In 64 bits, unlike cv::Rect's operator&, since boxes
/// come from anywhere.
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

/// The same without growth.
inline cv::Rect clip(const cv::Rect& rectangle, const cv::Size& image) {
  return clip_grown(rectangle, 0, 0, image);
}

/// a - b, wrapping round where the difference is not an int.
inline cv::Point wrapping_difference(cv::Point a, cv::Point b) {
  const auto difference = [](int minuend, int subtrahend) {
    return static_cast<int>(static_cast<std::uint32_t>(minuend) -
                            static_cast<std::uint32_t>(subtrahend));
  };
  return {difference(a.x, b.x), difference(a.y, b.y)};
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_RECTANGLES_HPP
