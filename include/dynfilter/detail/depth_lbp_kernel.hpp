// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The code of one pixel, with bit k for neighbour k clockwise from the top-left one.

#ifndef DYNFILTER_DETAIL_DEPTH_LBP_KERNEL_HPP
#define DYNFILTER_DETAIL_DEPTH_LBP_KERNEL_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstdint>
#include <cstring>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// A depth as an integer that sorts like it; 0 = no depth (0, negative, NaN, infinite).
inline std::uint32_t depth_order(std::uint16_t depth) { return depth; }

inline std::uint32_t depth_order(float depth) {
  // Positive floats sort like their bits; infinity and NaN stand above, negative ones above those.
  std::uint32_t bits = 0;
  std::memcpy(&bits, &depth, sizeof bits);
  return bits < 0x7F800000U ? bits : 0U;
}

template <class Depth>
bool has_depth(Depth depth) {
  return depth_order(depth) != 0;
}

/// Three neighbouring rows of a depth image.
template <class Depth>
struct DepthRows {
  const Depth* upper;
  const Depth* middle;
  const Depth* lower;

  static DepthRows around(const cv::Mat& depth, int y) {
    return {depth.ptr<Depth>(y - 1), depth.ptr<Depth>(y), depth.ptr<Depth>(y + 1)};
  }
};

/// `missing` is 0 if a neighbour without depth counts as nearer, and 1 if as farther: taking it
/// from both sides of the comparison leaves the order of depths alone (the centre's is at least 1)
/// and wraps "no depth" to the top.
template <class Depth>
std::uint8_t clockwise_code(const DepthRows<Depth>& rows, int x, std::uint32_t missing) {
  const std::uint32_t centre = depth_order(rows.middle[x]) - missing;
  // A shift and no choice of values, so that no branch hangs on depths, which nobody can foresee.
  const auto bit = [&](Depth neighbour, unsigned position) {
    return static_cast<unsigned>(depth_order(neighbour) - missing > centre) << position;
  };
  return static_cast<std::uint8_t>(bit(rows.upper[x - 1], 0) | bit(rows.upper[x], 1) |
                                   bit(rows.upper[x + 1], 2) | bit(rows.middle[x + 1], 3) |
                                   bit(rows.lower[x + 1], 4) | bit(rows.lower[x], 5) |
                                   bit(rows.lower[x - 1], 6) | bit(rows.middle[x - 1], 7));
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_LBP_KERNEL_HPP
