// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_MASK_PAINTING_HPP
#define DYNFILTER_DETAIL_MASK_PAINTING_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/instance.hpp"

namespace dynfilter::detail {

/// Returns the distances, in rows, to the nearest mask pixel of the same column. The result has
/// `count` rows from row `first` of the mask on, which may lie outside the mask, and one column for
/// each column of the mask. Distances above `reach` become `reach + 1`. O(area of result and mask).
inline cv::Mat_<int> rows_to_mask(const cv::Mat& mask, std::int64_t first, int count, int reach) {
  cv::Mat_<int> distances(count, mask.cols, reach + 1);
  std::vector<std::int64_t> nearest(static_cast<std::size_t>(mask.cols));
  const auto visit = [&](std::int64_t row) {
    const bool in_mask = row >= 0 && row < mask.rows;
    const bool in_result = row >= first && row < first + count;
    const std::uint8_t* pixels = in_mask ? mask.ptr<std::uint8_t>(static_cast<int>(row)) : nullptr;
    int* result = in_result ? distances[static_cast<int>(row - first)] : nullptr;
    for (std::size_t x = 0; x < nearest.size(); ++x) {
      if (in_mask && pixels[x] != 0) nearest[x] = row;
      if (!in_result) continue;
      const std::int64_t distance = row > nearest[x] ? row - nearest[x] : nearest[x] - row;
      result[x] = static_cast<int>(std::min<std::int64_t>(result[x], distance));
    }
  };
  constexpr std::int64_t nowhere = std::numeric_limits<std::int64_t>::min() / 2;
  const std::int64_t end = first + count;
  const std::int64_t mask_end = mask.rows;
  // Pass downwards, then upwards, each starting with the mask's rows outside the result but within
  // reach.
  std::fill(nearest.begin(), nearest.end(), nowhere);
  const std::int64_t top = std::max<std::int64_t>(0, first - reach);
  for (std::int64_t row = top; row < std::min(mask_end, first); ++row) visit(row);
  for (std::int64_t row = first; row < end; ++row) visit(row);
  std::fill(nearest.begin(), nearest.end(), nowhere);
  const std::int64_t bottom = std::min(mask_end, end + reach) - 1;
  for (std::int64_t row = bottom; row >= std::max<std::int64_t>(0, end); --row) visit(row);
  for (std::int64_t row = end - 1; row >= first; --row) visit(row);
  return distances;
}

/// Returns the part of an image within `reach` rows and columns of a mask; empty if there is none.
inline cv::Rect region_within(const Instance& instance, std::int64_t reach, const cv::Size& image) {
  const auto clamped = [](std::int64_t value, int limit) {
    return static_cast<int>(std::clamp<std::int64_t>(value, 0, limit));
  };
  const cv::Point origin = instance.mask_origin;
  const int left = clamped(origin.x - reach, image.width);
  const int top = clamped(origin.y - reach, image.height);
  const int right = clamped(origin.x + reach + instance.mask.cols, image.width);
  const int bottom = clamped(origin.y + reach + instance.mask.rows, image.height);
  return {left, top, right - left, bottom - top};
}

/// Counts the discs of `radius` that cover each pixel of an image row, as changes from pixel to
/// pixel. Each column of the mask has one disc, around its pixel nearest to the row, which lies
/// distances[x] rows away. `shift` is the x, in the row, of the mask's first column.
inline void count_discs(const int* distances, int columns, double radius, std::int64_t shift,
                        std::vector<int>& changes) {
  std::fill(changes.begin(), changes.end(), 0);
  const auto width = static_cast<std::int64_t>(changes.size()) - 1;
  int offset = -1;
  std::int64_t half = 0;  // half length of the chord at that offset
  for (int x = 0; x < columns; ++x) {
    if (distances[x] > radius) continue;
    if (distances[x] != offset) half = chord_half_length(radius, offset = distances[x]);
    const std::int64_t first = std::max<std::int64_t>(0, shift + x - half);
    const std::int64_t end = std::min(width, shift + x + half + 1);
    if (first >= end) continue;
    ++changes[static_cast<std::size_t>(first)];
    --changes[static_cast<std::size_t>(end)];
  }
}

/// Paints the pixels of a CV_8UC1 canvas, the whole image, that mask_within finds within `radius`
/// of the mask. The result is exact: squared distances are compared without rounding, row by row
/// from the distances within the columns (the separation in A. Meijster, J. Roerdink and W.
/// Hesselink, "A general algorithm for computing distance transforms in linear time", 2000). O(area
/// of the mask and of the painted box), for any radius.
inline void paint_mask_within(const Instance& instance, double radius, std::uint8_t value,
                              cv::Mat& canvas) {
  radius = std::clamp(radius, 0.0, max_mask_radius);
  const int reach = static_cast<int>(radius);
  const cv::Rect region = region_within(instance, reach, canvas.size());
  if (instance.mask.empty() || region.empty()) return;
  if (reach == 0) {
    const cv::Point offset = wrapping_difference(region.tl(), instance.mask_origin);
    canvas(region).setTo(cv::Scalar::all(value), instance.mask(cv::Rect(offset, region.size())));
    return;
  }
  const std::int64_t first_row = std::int64_t{region.y} - instance.mask_origin.y;
  const std::int64_t shift = std::int64_t{instance.mask_origin.x} - region.x;
  const cv::Mat_<int> distances = rows_to_mask(instance.mask, first_row, region.height, reach);
  std::vector<int> changes(static_cast<std::size_t>(region.width) + 1);
  for (int y = 0; y < region.height; ++y) {
    count_discs(distances[y], distances.cols, radius, shift, changes);
    std::uint8_t* pixels = canvas.ptr<std::uint8_t>(region.y + y) + region.x;
    int discs = 0;
    for (int x = 0; x < region.width; ++x) {
      discs += changes[static_cast<std::size_t>(x)];
      if (discs > 0) pixels[x] = value;
    }
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_MASK_PAINTING_HPP
