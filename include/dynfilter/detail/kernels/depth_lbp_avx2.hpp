// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Dense D-LBP with AVX2, 32 pixels at a time. AVX2 compares signed integers only; the results are
// packed to one byte per pixel before each gives its bit of the code. Intrinsics, because compilers
// make the plain C++ version 1.1 to 150 times slower.

#ifndef DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_AVX2_HPP
#define DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_AVX2_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "dynfilter/detail/kernels/depth_lbp_strip.hpp"

#if DYNFILTER_HAS_X86_KERNELS

#include <immintrin.h>

namespace dynfilter::detail {

/// Operations that depend on the type of depth. Packing works within halves of a register, so the
/// bytes of a mask are out of order until `in_order`.
template <class Depth>
struct Avx2;

template <>
struct Avx2<std::uint16_t> {
  struct Depths {
    __m256i a, b;
  };
  DYNFILTER_AVX2_INLINE static __m256i broadcast(std::uint16_t value) {
    return _mm256_set1_epi16(static_cast<short>(value));
  }
  DYNFILTER_AVX2_INLINE static Depths load(const std::uint16_t* from, __m256i bias) {
    const auto* vectors = reinterpret_cast<const __m256i*>(from);
    return {_mm256_add_epi16(_mm256_loadu_si256(vectors), bias),
            _mm256_add_epi16(_mm256_loadu_si256(vectors + 1), bias)};
  }
  DYNFILTER_AVX2_INLINE static Depths add(const Depths& x, __m256i bias) {
    return {_mm256_add_epi16(x.a, bias), _mm256_add_epi16(x.b, bias)};
  }
  DYNFILTER_AVX2_INLINE static __m256i greater(const Depths& x, const Depths& y) {
    return _mm256_packs_epi16(_mm256_cmpgt_epi16(x.a, y.a), _mm256_cmpgt_epi16(x.b, y.b));
  }
  DYNFILTER_AVX2_INLINE static Depths both(__m256i value) { return {value, value}; }
  DYNFILTER_AVX2_INLINE static __m256i in_order(__m256i bytes) {
    return _mm256_permute4x64_epi64(bytes, _MM_SHUFFLE(3, 1, 2, 0));
  }
};

template <>
struct Avx2<float> {
  struct Depths {
    __m256i a, b, c, d;
  };
  DYNFILTER_AVX2_INLINE static __m256i broadcast(std::uint32_t value) {
    return _mm256_set1_epi32(static_cast<int>(value));
  }
  DYNFILTER_AVX2_INLINE static Depths load(const float* from, __m256i bias) {
    const auto* vectors = reinterpret_cast<const __m256i*>(from);
    return add({_mm256_loadu_si256(vectors), _mm256_loadu_si256(vectors + 1),
                _mm256_loadu_si256(vectors + 2), _mm256_loadu_si256(vectors + 3)},
               bias);
  }
  DYNFILTER_AVX2_INLINE static Depths add(const Depths& x, __m256i bias) {
    return {_mm256_add_epi32(x.a, bias), _mm256_add_epi32(x.b, bias), _mm256_add_epi32(x.c, bias),
            _mm256_add_epi32(x.d, bias)};
  }
  DYNFILTER_AVX2_INLINE static __m256i greater(const Depths& x, const Depths& y) {
    return _mm256_packs_epi16(
        _mm256_packs_epi32(_mm256_cmpgt_epi32(x.a, y.a), _mm256_cmpgt_epi32(x.b, y.b)),
        _mm256_packs_epi32(_mm256_cmpgt_epi32(x.c, y.c), _mm256_cmpgt_epi32(x.d, y.d)));
  }
  DYNFILTER_AVX2_INLINE static Depths both(__m256i value) { return {value, value, value, value}; }
  DYNFILTER_AVX2_INLINE static __m256i in_order(__m256i bytes) {
    return _mm256_permutevar8x32_epi32(bytes, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7));
  }
};

template <class Depth>
class DepthLbpAvx2 {
 public:
  static constexpr std::ptrdiff_t columns = 32;

  [[DYNFILTER_AVX2, gnu::always_inline]] explicit DepthLbpAvx2(const DepthLbpRule<Depth>& rule)
      : bias_(Set::broadcast(rule.signed_bias())),
        unbias_(Set::broadcast(rule.unbias())),
        depths_(Set::broadcast(rule.signed_depths)) {
    for (std::size_t k = 0; k < 8; ++k) {
      weights_[k] = _mm256_set1_epi8(static_cast<char>(1U << rule.bits[k]));
    }
  }

  /// Computes the codes of 32 pixels.
  DYNFILTER_AVX2_INLINE void operator()(const Depth* from, std::ptrdiff_t stride,
                                        std::uint8_t* to) const {
    const Depth* upper = from - stride;
    const Depth* lower = from + stride;
    const auto centre = Set::load(from, bias_);
    __m256i codes = bit(0, upper - 1, centre);
    codes = _mm256_or_si256(codes, bit(1, upper, centre));
    codes = _mm256_or_si256(codes, bit(2, upper + 1, centre));
    codes = _mm256_or_si256(codes, bit(3, from + 1, centre));
    codes = _mm256_or_si256(codes, bit(4, lower + 1, centre));
    codes = _mm256_or_si256(codes, bit(5, lower, centre));
    codes = _mm256_or_si256(codes, bit(6, lower - 1, centre));
    codes = _mm256_or_si256(codes, bit(7, from - 1, centre));
    const __m256i has_depth = Set::greater(Set::both(depths_), Set::add(centre, unbias_));
    codes = Set::in_order(_mm256_and_si256(codes, has_depth));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), codes);
  }

 private:
  using Set = Avx2<Depth>;

  DYNFILTER_AVX2_INLINE __m256i bit(std::size_t k, const Depth* neighbour,
                                    const typename Set::Depths& centre) const {
    return _mm256_and_si256(Set::greater(Set::load(neighbour, bias_), centre), weights_[k]);
  }

  __m256i bias_, unbias_, depths_;
  __m256i weights_[8];
};

/// Computes the codes of a strip of at least 32 columns. The last block overlaps the one before.
template <class Depth>
[[DYNFILTER_AVX2]] void depth_lbp_avx2(const DepthLbpStrip<Depth>& strip,
                                       const DepthLbpRule<Depth>& rule) {
  using Kernel = DepthLbpAvx2<Depth>;
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

#endif  // DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_AVX2_HPP
