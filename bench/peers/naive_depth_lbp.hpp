// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>

namespace dynfilter::peers {

inline bool is_measured(std::uint16_t depth) { return depth > 0; }
inline bool is_measured(float depth) { return depth > 0 && std::isfinite(depth); }

/// Code of an inner pixel by cv::Mat::at, without a branch on unpredictable depth; 0 without depth.
template <class Depth>
std::uint8_t naive_code(const cv::Mat& depth, int x, int y) {
  const auto centre = depth.at<Depth>(y, x);
  const auto bit = [&](int row, int column, unsigned k) {
    const auto neighbour = depth.at<Depth>(row, column);
    const auto farther = static_cast<unsigned>(neighbour > centre);
    return (farther & static_cast<unsigned>(is_measured(neighbour))) << k;
  };
  const unsigned code = bit(y - 1, x - 1, 0) | bit(y - 1, x, 1) | bit(y - 1, x + 1, 2) |
                        bit(y, x + 1, 3) | bit(y + 1, x + 1, 4) | bit(y + 1, x, 5) |
                        bit(y + 1, x - 1, 6) | bit(y, x - 1, 7);
  return static_cast<std::uint8_t>(is_measured(centre) ? code : 0U);
}

/// Computes the codes of some rows. Those of the border stay.
template <class Depth>
void naive_dense(const cv::Mat& depth, const cv::Range& rows, cv::Mat& codes) {
  for (int y = std::max(rows.start, 1); y < std::min(rows.end, depth.rows - 1); ++y) {
    for (int x = 1; x < depth.cols - 1; ++x) {
      codes.at<std::uint8_t>(y, x) = naive_code<Depth>(depth, x, y);
    }
  }
}

}  // namespace dynfilter::peers
