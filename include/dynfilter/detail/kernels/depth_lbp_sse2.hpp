// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Dense D-LBP with SSE2, which every x86-64 processor has, 16 pixels at a time. Works like
// depth_lbp_avx2.hpp in registers of half the width.

#ifndef DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_SSE2_HPP
#define DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_SSE2_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "dynfilter/detail/kernels/depth_lbp_strip.hpp"

#if DYNFILTER_HAS_X86_KERNELS

#include <emmintrin.h>

namespace dynfilter::detail {

/// Operations that depend on the type of depth.
template <class Depth>
struct Sse2;

template <>
struct Sse2<std::uint16_t> {
  struct Depths {
    __m128i a, b;
  };
  static __m128i broadcast(std::uint16_t value) {
    return _mm_set1_epi16(static_cast<short>(value));
  }
  static Depths load(const std::uint16_t* from, __m128i bias) {
    const auto* vectors = reinterpret_cast<const __m128i*>(from);
    return {_mm_add_epi16(_mm_loadu_si128(vectors), bias),
            _mm_add_epi16(_mm_loadu_si128(vectors + 1), bias)};
  }
  static Depths add(const Depths& x, __m128i bias) {
    return {_mm_add_epi16(x.a, bias), _mm_add_epi16(x.b, bias)};
  }
  static __m128i greater(const Depths& x, const Depths& y) {
    return _mm_packs_epi16(_mm_cmpgt_epi16(x.a, y.a), _mm_cmpgt_epi16(x.b, y.b));
  }
  static Depths both(__m128i value) { return {value, value}; }
};

template <>
struct Sse2<float> {
  struct Depths {
    __m128i a, b, c, d;
  };
  static __m128i broadcast(std::uint32_t value) { return _mm_set1_epi32(static_cast<int>(value)); }
  static Depths load(const float* from, __m128i bias) {
    const auto* vectors = reinterpret_cast<const __m128i*>(from);
    return add({_mm_loadu_si128(vectors), _mm_loadu_si128(vectors + 1),
                _mm_loadu_si128(vectors + 2), _mm_loadu_si128(vectors + 3)},
               bias);
  }
  static Depths add(const Depths& x, __m128i bias) {
    return {_mm_add_epi32(x.a, bias), _mm_add_epi32(x.b, bias), _mm_add_epi32(x.c, bias),
            _mm_add_epi32(x.d, bias)};
  }
  static __m128i greater(const Depths& x, const Depths& y) {
    return _mm_packs_epi16(_mm_packs_epi32(_mm_cmpgt_epi32(x.a, y.a), _mm_cmpgt_epi32(x.b, y.b)),
                           _mm_packs_epi32(_mm_cmpgt_epi32(x.c, y.c), _mm_cmpgt_epi32(x.d, y.d)));
  }
  static Depths both(__m128i value) { return {value, value, value, value}; }
};

template <class Depth>
class DepthLbpSse2 {
 public:
  static constexpr std::ptrdiff_t columns = 16;

  explicit DepthLbpSse2(const DepthLbpRule<Depth>& rule)
      : bias_(Set::broadcast(rule.signed_bias())),
        unbias_(Set::broadcast(rule.unbias())),
        depths_(Set::broadcast(rule.signed_depths)) {
    for (std::size_t k = 0; k < 8; ++k) {
      weights_[k] = _mm_set1_epi8(static_cast<char>(1U << rule.bits[k]));
    }
  }

  /// Computes the codes of 16 pixels.
  void operator()(const Depth* from, std::ptrdiff_t stride, std::uint8_t* to) const {
    const Depth* upper = from - stride;
    const Depth* lower = from + stride;
    const auto centre = Set::load(from, bias_);
    __m128i codes = bit(0, upper - 1, centre);
    codes = _mm_or_si128(codes, bit(1, upper, centre));
    codes = _mm_or_si128(codes, bit(2, upper + 1, centre));
    codes = _mm_or_si128(codes, bit(3, from + 1, centre));
    codes = _mm_or_si128(codes, bit(4, lower + 1, centre));
    codes = _mm_or_si128(codes, bit(5, lower, centre));
    codes = _mm_or_si128(codes, bit(6, lower - 1, centre));
    codes = _mm_or_si128(codes, bit(7, from - 1, centre));
    const __m128i has_depth = Set::greater(Set::both(depths_), Set::add(centre, unbias_));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm_and_si128(codes, has_depth));
  }

 private:
  using Set = Sse2<Depth>;

  __m128i bit(std::size_t k, const Depth* neighbour, const typename Set::Depths& centre) const {
    return _mm_and_si128(Set::greater(Set::load(neighbour, bias_), centre), weights_[k]);
  }

  __m128i bias_, unbias_, depths_;
  __m128i weights_[8];
};

/// Computes the codes of a strip of at least 16 columns. The last block overlaps the one before.
template <class Depth>
void depth_lbp_sse2(const DepthLbpStrip<Depth>& strip, const DepthLbpRule<Depth>& rule) {
  using Kernel = DepthLbpSse2<Depth>;
  const Kernel kernel(rule);
  const std::ptrdiff_t last = strip.columns - Kernel::columns;
  for (std::ptrdiff_t y = 0; y < strip.rows; ++y) {
    const Depth* from = strip.depth + y * strip.depth_stride;
    std::uint8_t* to = strip.codes + y * strip.codes_stride;
    for (std::ptrdiff_t x = 0; x < last; x += Kernel::columns) {
      kernel(from + x, strip.depth_stride, to + x);
    }
    kernel(from + last, strip.depth_stride, to + last);
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_HAS_X86_KERNELS

#endif  // DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_SSE2_HPP
