// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_MASK_PAINTING_HPP
#define DYNFILTER_DETAIL_MASK_PAINTING_HPP

#include <algorithm>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/mask_row.hpp"
#include "dynfilter/instance.hpp"

namespace dynfilter::detail {

/// Paints the pixels of a CV_8UC1 canvas, the whole image, that mask_within finds within `radius`
/// of the mask, exactly: in a row that is n rows away, a run of mask pixels reaches half the chord
/// of the disc at n beyond its ends. O(runs of mask pixels x rows within the radius, and the pixels
/// that each paints).
inline void paint_mask_within(const Instance& instance, double radius, std::uint8_t value,
                              cv::Mat& canvas) {
  radius = std::clamp(radius, 0.0, max_mask_radius);
  const auto reach = static_cast<std::int64_t>(radius);
  const auto paint_around = [&](std::int64_t row, std::int64_t first_x, std::int64_t end_x) {
    const std::int64_t end_y = std::min<std::int64_t>(canvas.rows, row + reach + 1);
    for (std::int64_t y = std::max<std::int64_t>(0, row - reach); y < end_y; ++y) {
      const std::int64_t half = chord_half_length(radius, static_cast<double>(y - row));
      const auto begin = std::clamp<std::int64_t>(first_x - half, 0, canvas.cols);
      const auto end = std::clamp<std::int64_t>(end_x + half, begin, canvas.cols);
      std::uint8_t* const pixels = canvas.ptr<std::uint8_t>(static_cast<int>(y));
      std::fill(pixels + begin, pixels + end, value);
    }
  };
  for (int row = 0; row < instance.mask.rows; ++row) {
    const std::uint8_t* const pixels = instance.mask.ptr<std::uint8_t>(row);
    const std::uint8_t* const row_end = pixels + instance.mask.cols;
    const std::int64_t x = instance.mask_origin.x, y = instance.mask_origin.y;
    for (const std::uint8_t* first = find_mask_pixel(pixels, row_end); first != row_end;) {
      const std::uint8_t* const end = find_mask_end(first, row_end);
      paint_around(y + row, x + (first - pixels), x + (end - pixels));
      first = find_mask_pixel(end, row_end);
    }
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_MASK_PAINTING_HPP
