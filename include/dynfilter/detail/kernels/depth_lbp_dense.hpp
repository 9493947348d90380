// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Dense D-LBP with the best instruction set of the processor that runs the program, whatever it was
// compiled for.

#ifndef DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_DENSE_HPP
#define DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_DENSE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/kernels/depth_lbp_avx2.hpp"
#include "dynfilter/detail/kernels/depth_lbp_sse2.hpp"
#include "dynfilter/detail/kernels/depth_lbp_strip.hpp"
#include "dynfilter/detail/kernels/instruction_set.hpp"

namespace dynfilter::detail {

/// Computes the codes of a strip. A strip narrower than the block of an instruction set uses a
/// lower set.
template <class Depth>
void depth_lbp(const DepthLbpStrip<Depth>& strip, const DepthLbpRule<Depth>& rule,
               [[maybe_unused]] InstructionSet best) {
#if DYNFILTER_HAS_X86_KERNELS
  const auto may_use = [&](InstructionSet set, std::ptrdiff_t columns) {
    return best >= set && strip.columns >= columns;
  };
  if (may_use(InstructionSet::avx2, DepthLbpAvx2<Depth>::columns)) {
    return depth_lbp_avx2(strip, rule);
  }
  if (may_use(InstructionSet::sse2, DepthLbpSse2<Depth>::columns)) {
    return depth_lbp_sse2(strip, rule);
  }
#endif
  depth_lbp_portable(strip, rule);
}

/// Computes the codes of a region, which must lie in the image: 0 on the border.
template <class Depth>
void dense_depth_lbp(const cv::Mat& depth, const cv::Rect& region, const DepthLbpRule<Depth>& rule,
                     InstructionSet best, cv::Mat& codes) {
  if (region.empty()) return;
  const int first_x = std::max(region.x, 1);
  const int first_y = std::max(region.y, 1);
  const int end_x = std::min(region.x + region.width, depth.cols - 1);
  const int end_y = std::min(region.y + region.height, depth.rows - 1);
  const auto clear = [&codes](int y, int begin, int end) {
    if (begin < end) std::fill(codes.ptr(y) + begin, codes.ptr(y) + end, std::uint8_t{0});
  };
  for (int y = region.y; y < region.y + region.height; ++y) {
    const bool is_border = y < first_y || y >= end_y;
    clear(y, region.x, is_border ? region.x + region.width : first_x);
    clear(y, std::max(end_x, region.x), region.x + region.width);
  }
  if (first_x >= end_x || first_y >= end_y) return;
  const DepthLbpStrip<Depth> strip = {depth.ptr<Depth>(first_y) + first_x,
                                      static_cast<std::ptrdiff_t>(depth.step1()),
                                      codes.ptr(first_y) + first_x,
                                      static_cast<std::ptrdiff_t>(codes.step1()),
                                      end_y - first_y,
                                      end_x - first_x};
  depth_lbp(strip, rule, best);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_DENSE_HPP
