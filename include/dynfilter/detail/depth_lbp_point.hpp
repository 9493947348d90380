// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_DEPTH_LBP_POINT_HPP
#define DYNFILTER_DETAIL_DEPTH_LBP_POINT_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Whether a raw depth is valid: it is not 0, negative, NaN or infinite.
inline bool is_depth(std::uint16_t depth) { return depth != 0; }
inline bool is_depth(float depth) { return depth > 0 && std::isfinite(depth); }

/// Returns the D-LBP code of one pixel, or nothing on the border, outside the image, and without
/// depth.
template <class Depth>
std::optional<std::uint8_t> depth_lbp_code(const cv::Mat& depth, cv::Point pixel) {
  const bool has_neighbours =
      pixel.x >= 1 && pixel.y >= 1 && pixel.x < depth.cols - 1 && pixel.y < depth.rows - 1;
  if (!has_neighbours) return {};
  const Depth* const upper = depth.ptr<Depth>(pixel.y - 1) + pixel.x;
  const Depth* const middle = depth.ptr<Depth>(pixel.y) + pixel.x;
  const Depth* const lower = depth.ptr<Depth>(pixel.y + 1) + pixel.x;
  if (!is_depth(*middle)) return {};
  const std::array<Depth, 8> clockwise = {upper[-1], upper[0], upper[1],  middle[1],
                                          lower[1],  lower[0], lower[-1], middle[-1]};
  unsigned code = 0;
  for (std::size_t k = 0; k < clockwise.size(); ++k) {
    // Branch-free, because no processor foresees which neighbours are farther.
    const unsigned is_known = is_depth(clockwise[k]), is_farther = clockwise[k] > *middle;
    code |= (is_known & is_farther) << k;
  }
  return static_cast<std::uint8_t>(code);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_LBP_POINT_HPP
