// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <opencv2/core.hpp>

#include "dynfilter/instance.hpp"

namespace dynfilter::detail {

/// Returns the first pixel of a part of a mask's row that is on the mask, or `end`. Eight pixels
/// off the mask are a number that is 0.
inline const std::uint8_t* find_mask_pixel(const std::uint8_t* first, const std::uint8_t* end) {
  for (std::uint64_t eight; end - first >= 8; first += 8) {
    std::memcpy(&eight, first, sizeof(eight));
    if (eight != 0) break;
  }
  return std::find_if(first, end, [](std::uint8_t pixel) { return pixel != 0; });
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
    const std::uint8_t* const end_pixel = in_mask(x + half + 1);
    if (find_mask_pixel(in_mask(x - half), end_pixel) != end_pixel) return true;
  }
  return false;
}

}  // namespace dynfilter::detail
