// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_MASK_DISTANCE_HPP
#define DYNFILTER_DETAIL_MASK_DISTANCE_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <opencv2/core.hpp>

#include "dynfilter/instance.hpp"

namespace dynfilter::detail {

/// Reads eight pixels of a mask's row as one number, which is 0 if none of them is on the mask.
inline std::uint64_t mask_word(const std::uint8_t* pixels) {
  std::uint64_t word;
  std::memcpy(&word, pixels, sizeof(word));
  return word;
}

/// Returns the first pixel of a part of a mask's row that is on the mask, or `end`.
inline const std::uint8_t* find_mask_pixel(const std::uint8_t* first, const std::uint8_t* end) {
  while (end - first >= 8 && mask_word(first) == 0) first += 8;
  return std::find_if(first, end, [](std::uint8_t pixel) { return pixel != 0; });
}

/// Whether any pixel of a part of a mask's row is on the mask. `first` must not be after `end`.
inline bool has_mask_pixel(const std::uint8_t* first, const std::uint8_t* end) {
  return find_mask_pixel(first, end) != end;
}

/// Returns the first pixel of a part of a mask's row that is off the mask, or `end`.
inline const std::uint8_t* find_mask_end(const std::uint8_t* first, const std::uint8_t* end) {
  const void* const found = std::memchr(first, 0, static_cast<std::size_t>(end - first));
  return found == nullptr ? end : static_cast<const std::uint8_t*>(found);
}

/// Returns half the length of a disc's row at `offset` rows from its centre: the largest dx with
/// dx^2 + offset^2 <= radius^2. `offset` must not exceed the radius.
inline std::int64_t chord_half_length(double radius, double offset) {
  // The root is a guess. Only whole numbers are compared with the rounded square, as mask_within
  // does: a compiler may fuse the difference of two products and round it otherwise.
  const auto is_within = [&](std::int64_t half) {
    return static_cast<double>(half * half) + offset * offset <= radius * radius;
  };
  const double square = radius * radius - offset * offset;
  auto half = static_cast<std::int64_t>(std::sqrt(std::max(0.0, square)));
  while (half > 0 && !is_within(half)) --half;
  while (is_within(half + 1)) ++half;
  return half;
}

/// Limit of the radius; larger ones are clamped to it. It exceeds any image, and its square is
/// exact.
inline constexpr double max_mask_radius = 67108864.0;

/// Whether a pixel of the mask lies within `radius` pixels (Euclidean, between pixel centres) of
/// `pixel`. A radius of 0, negative or NaN tests the pixel itself. O(radius^2), and at most
/// O(pixels of the mask).
inline bool mask_within(const Instance& instance, cv::Point pixel, double radius) {
  if (!(radius > 0)) return instance.covers(pixel);
  radius = std::min(radius, max_mask_radius);
  const auto reach = static_cast<std::int64_t>(radius);
  const cv::Mat& mask = instance.mask;
  const std::int64_t x = std::int64_t{pixel.x} - instance.mask_origin.x;
  const std::int64_t y = std::int64_t{pixel.y} - instance.mask_origin.y;
  if (x + reach < 0 || x - reach >= mask.cols) return false;
  const std::int64_t end = std::min<std::int64_t>(mask.rows, y + reach + 1);
  for (std::int64_t row = std::max<std::int64_t>(0, y - reach); row < end; ++row) {
    const std::int64_t half = chord_half_length(radius, static_cast<double>(row - y));
    const std::uint8_t* const pixels = mask.ptr<std::uint8_t>(static_cast<int>(row));
    const auto in_mask = [&](std::int64_t column) {
      return pixels + std::clamp<std::int64_t>(column, 0, mask.cols);
    };
    if (has_mask_pixel(in_mask(x - half), in_mask(x + half + 1))) return true;
  }
  return false;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_MASK_DISTANCE_HPP
