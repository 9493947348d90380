// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_MASK_DISTANCE_HPP
#define DYNFILTER_DETAIL_MASK_DISTANCE_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/mask_row.hpp"
#include "dynfilter/instance.hpp"

namespace dynfilter::detail {

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
constexpr double max_mask_radius = 67108864.0;

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
  // Rows beyond the mask's are skipped: the mask may be far away, and the radius large.
  const std::int64_t nearest = y < 0 ? -y : std::max<std::int64_t>(0, y - mask.rows + 1);
  const std::int64_t farthest = std::min(reach, std::max(y, mask.rows - 1 - y));
  if (nearest > farthest) return false;
  std::int64_t half = chord_half_length(radius, static_cast<double>(nearest));
  const auto in_mask = [&](std::int64_t column) {
    return std::clamp<std::int64_t>(column, 0, mask.cols);
  };
  const auto has_pixel_in = [&](std::int64_t row) {
    if (row < 0 || row >= mask.rows) return false;
    const std::uint8_t* const pixels = mask.ptr<std::uint8_t>(static_cast<int>(row));
    return has_mask_pixel(pixels + in_mask(x - half), pixels + in_mask(x + half + 1));
  };
  for (std::int64_t offset = nearest; offset <= farthest; ++offset) {
    while (static_cast<double>(half * half + offset * offset) > radius * radius) --half;
    if (has_pixel_in(y - offset) || (offset > 0 && has_pixel_in(y + offset))) return true;
  }
  return false;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_MASK_DISTANCE_HPP
