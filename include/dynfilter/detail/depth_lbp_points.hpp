// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// D-LBP codes at points.

#ifndef DYNFILTER_DETAIL_DEPTH_LBP_POINTS_HPP
#define DYNFILTER_DETAIL_DEPTH_LBP_POINTS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_lbp_kernel.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <emmintrin.h>
#endif

namespace dynfilter::detail {

#if DYNFILTER_HAS_X86_KERNELS

// What clockwise_code does, for all neighbours at once: SSE2 is what every x86-64 processor has.

[[gnu::always_inline]] inline unsigned clockwise_code_at(const DepthRows<std::uint16_t>& rows,
                                                         std::ptrdiff_t x, std::uint16_t bias) {
  const auto [upper, middle, lower] = rows;
  // One by one, and no _mm_set(1)_epi16, of which g++ makes detours by way of memory.
  __m128i neighbours = _mm_cvtsi32_si128(upper[x - 1]);
  neighbours = _mm_insert_epi16(neighbours, upper[x], 1);
  neighbours = _mm_insert_epi16(neighbours, upper[x + 1], 2);
  neighbours = _mm_insert_epi16(neighbours, middle[x + 1], 3);
  neighbours = _mm_insert_epi16(neighbours, lower[x + 1], 4);
  neighbours = _mm_insert_epi16(neighbours, lower[x], 5);
  neighbours = _mm_insert_epi16(neighbours, lower[x - 1], 6);
  neighbours = _mm_insert_epi16(neighbours, middle[x - 1], 7);
  const auto broadcast = [](int value) __attribute__((always_inline)) {
    const __m128i four = _mm_shufflelo_epi16(_mm_cvtsi32_si128(value), 0);
    return _mm_unpacklo_epi64(four, four);
  };
  const __m128i signed_bias = broadcast(bias ^ 0x8000);
  const __m128i farther = _mm_cmpgt_epi16(_mm_add_epi16(neighbours, signed_bias),
                                          _mm_add_epi16(broadcast(middle[x]), signed_bias));
  return static_cast<unsigned>(_mm_movemask_epi8(_mm_packs_epi16(farther, _mm_setzero_si128())));
}

[[gnu::always_inline]] inline unsigned clockwise_code_at(const DepthRows<float>& rows,
                                                         std::ptrdiff_t x, std::uint32_t bias) {
  const auto [upper, middle, lower] = rows;
  const __m128i signed_bias = _mm_set1_epi32(static_cast<int>(bias ^ 0x80000000U));
  const auto biased = [&](__m128 depths) __attribute__((always_inline)) {
    return _mm_add_epi32(_mm_castps_si128(depths), signed_bias);
  };
  const __m128i first = biased(_mm_set_ps(middle[x + 1], upper[x + 1], upper[x], upper[x - 1]));
  const __m128i second = biased(_mm_set_ps(middle[x - 1], lower[x - 1], lower[x], lower[x + 1]));
  const __m128i centre = biased(_mm_set1_ps(middle[x]));
  return static_cast<unsigned>(_mm_movemask_epi8(_mm_packs_epi16(
      _mm_packs_epi32(_mm_cmpgt_epi32(first, centre), _mm_cmpgt_epi32(second, centre)),
      _mm_setzero_si128())));
}

#else

template <class Depth>
unsigned clockwise_code_at(const DepthRows<Depth>& rows, std::ptrdiff_t x,
                           typename DepthBits<Depth>::Type bias) {
  return clockwise_code(rows, x, bias);
}

#endif

/// Codes at points of one image. What it knows of the image stands here by value, because the
/// compiler must take codes, which are bytes, for something that may overwrite a cv::Mat.
template <class Depth>
class DepthLbpPoints {
 public:
  DepthLbpPoints(const cv::Mat& depth, bool missing_is_farther)
      : data_(depth.data),
        step_(static_cast<std::ptrdiff_t>(depth.step[0])),
        last_x_(depth.cols - 1),
        last_y_(depth.rows - 1),
        bias_(depth_bias<Depth>(missing_is_farther)) {}

  /// Whether the pixel has all eight neighbours.
  [[gnu::always_inline]] bool is_inner(int x, int y) const {
    return x >= 1 && y >= 1 && x < last_x_ && y < last_y_;
  }

  /// Starts to load what the code of a pixel, if it has one, is made of.
  [[gnu::always_inline]] void prefetch([[maybe_unused]] int x, [[maybe_unused]] int y) const {
#if defined(__GNUC__)
    if (!is_inner(x, y)) return;
    const unsigned char* middle = data_ + y * step_ + x * std::ptrdiff_t{sizeof(Depth)};
    __builtin_prefetch(middle - step_);
    __builtin_prefetch(middle);
    __builtin_prefetch(middle + step_);
#endif
  }

  /// The clockwise code of an inner pixel, and whether it has one.
  [[gnu::always_inline]] unsigned clockwise_code(int x, int y, bool& exists) const {
    const unsigned char* middle = data_ + y * step_;
    const DepthRows<Depth> rows = {reinterpret_cast<const Depth*>(middle - step_),
                                   reinterpret_cast<const Depth*>(middle),
                                   reinterpret_cast<const Depth*>(middle + step_)};
    exists = has_depth(rows.middle[x]);
    return clockwise_code_at(rows, x, bias_);
  }

 private:
  const unsigned char* data_;
  std::ptrdiff_t step_;
  int last_x_, last_y_;
  typename DepthBits<Depth>::Type bias_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_LBP_POINTS_HPP
