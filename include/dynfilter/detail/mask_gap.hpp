// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_MASK_GAP_HPP
#define DYNFILTER_DETAIL_MASK_GAP_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/instance.hpp"

namespace dynfilter::detail {

/// Walks from the end of a row of a mask outwards (direction -1 or 1) to where the object's depth
/// ends, over holes of two pixels; or inwards to where it begins, if it does not reach the end of
/// the mask. Returns the distance, negative inwards; nothing if it exceeds its limit.
template <class IsObjects>
std::optional<int> edge_gap(cv::Point end, int direction, int max_outwards, int max_inwards,
                            const IsObjects& is_object) {
  const auto is_object_at = [&](int distance) {
    return is_object(cv::Point(end.x + direction * distance, end.y));
  };
  int gap = 0;
  while (gap >= -max_inwards && !is_object_at(gap)) --gap;
  if (max_outwards == 0 || gap < -max_inwards) return {};
  for (int next = 1; gap >= 0 && next <= gap + 3; ++next) {
    if (next > max_outwards) return {};
    if (is_object_at(next)) gap = next;
  }
  return gap;
}

/// Gap between a mask and the edge of its object's depth, medians over rows of the mask, pixels.
struct MaskGap {
  double width;       // by which the depth goes on beyond the mask, mean of left and right
  double shift;       // by which the depth lies to the right of the mask
  std::size_t edges;  // number of ends of rows that were measured

  /// Distances at the left and right ends of rows.
  using Memory = std::array<std::vector<int>, 2>;
};

/// Measures the gap of a mask in every `spacing`-th row of its part in the image, `masked`.
/// `is_object` tells whether a pixel has the object's depth, which is followed up to
/// `max_distance` pixels. Returns nothing if its end is found in too few rows.
template <class IsObjects>
std::optional<MaskGap> measure_mask_gap(const Instance& instance, const cv::Rect& masked,
                                        int spacing, int max_distance, int image_width,
                                        const IsObjects& is_object, MaskGap::Memory& gaps) {
  constexpr std::size_t min_rows = 4;  // With more, the gaps of small objects stay unknown.
  for (auto& side : gaps) side.clear();
  for (int y = masked.y + spacing / 2; y < masked.br().y; y += spacing) {
    const std::uint8_t* const row = instance.mask.ptr<std::uint8_t>(y - instance.mask_origin.y) +
                                    (masked.x - instance.mask_origin.x);
    const std::uint8_t *const first = find_mask_pixel(row, row + masked.width),
                              *last = row + masked.width - 1;
    while (last >= first && *last == 0) --last;
    if (last < first) continue;
    const int left = masked.x + static_cast<int>(first - row);
    const int right = masked.x + static_cast<int>(last - row);
    const auto measure = [&](int x, int direction, int room, std::vector<int>& side) {
      const auto gap = edge_gap({x, y}, direction, std::min(max_distance, room),
                                std::min(max_distance, right - left), is_object);
      if (gap) side.push_back(*gap);
    };
    measure(left, -1, left, gaps[0]);
    measure(right, 1, image_width - 1 - right, gaps[1]);
  }
  if (std::min(gaps[0].size(), gaps[1].size()) < min_rows) return {};
  const double left = quantile_of(gaps[0]), right = quantile_of(gaps[1]);
  return MaskGap{(left + right) / 2, (right - left) / 2, gaps[0].size() + gaps[1].size()};
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_MASK_GAP_HPP
