// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// D-LBP codes at points by AVX-512: instructions that pick numbers out of two registers put the
// neighbours in the order of the code's bits, so that one comparison gives the code.

#ifndef DYNFILTER_DETAIL_DEPTH_LBP_POINTS_AVX512_HPP
#define DYNFILTER_DETAIL_DEPTH_LBP_POINTS_AVX512_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

#include "dynfilter/detail/depth_lbp_kernel.hpp"
#include "dynfilter/detail/instruction_set.hpp"

#if DYNFILTER_HAS_X86_KERNELS

#include <immintrin.h>

namespace dynfilter::detail {

/// Where the neighbours clockwise from the top-left one stand among four depths of the upper row,
/// four of the lower and four of the middle one, each from the left neighbour on.
constexpr std::array<std::uint8_t, 8> places_clockwise = {0, 1, 2, 10, 6, 5, 4, 8};

/// The place of the neighbour of each bit of a code.
inline std::array<std::uint8_t, 8> places_of_bits(const std::array<std::uint8_t, 8>& bits) {
  std::array<std::uint8_t, 8> places{};
  for (std::size_t k = 0; k < 8; ++k) places[bits[k]] = places_clockwise[k];
  return places;
}

#define DYNFILTER_AVX512 gnu::target("avx512f,avx512bw,avx512vl")

/// What the codes of an image are made with. Of each row four depths are read, the last of which is
/// of no account but must be there.
template <class Depth>
struct PointCodesAvx512;

template <>
struct PointCodesAvx512<std::uint16_t> {
  [[DYNFILTER_AVX512]] PointCodesAvx512(const std::array<std::uint8_t, 8>& places_there,
                                        std::uint16_t bias_there)
      : places(_mm_cvtepu8_epi16(_mm_loadl_epi64(four_of(places_there.data())))),
        bias(_mm_set1_epi16(static_cast<short>(bias_there))) {}

  [[DYNFILTER_AVX512, gnu::always_inline]] std::uint16_t operator()(
      const DepthRows<std::uint16_t>& rows, std::ptrdiff_t x) const {
    const __m128i outer = _mm_unpacklo_epi64(_mm_loadl_epi64(four_of(rows.upper + x - 1)),
                                             _mm_loadl_epi64(four_of(rows.lower + x - 1)));
    const __m128i middle = _mm_loadl_epi64(four_of(rows.middle + x - 1));
    const __m128i neighbours = _mm_permutex2var_epi16(outer, places, middle);
    const __m128i centre = _mm_set1_epi16(static_cast<short>(rows.middle[x]));
    return _mm_cmpgt_epu16_mask(_mm_add_epi16(neighbours, bias), _mm_add_epi16(centre, bias));
  }

  template <class Number>
  static const __m128i* four_of(const Number* first) {
    return reinterpret_cast<const __m128i*>(first);
  }

  __m128i places, bias;
};

template <>
struct PointCodesAvx512<float> {
  [[DYNFILTER_AVX512]] PointCodesAvx512(const std::array<std::uint8_t, 8>& places_there,
                                        std::uint32_t bias_there)
      : places(_mm256_cvtepu8_epi32(
            _mm_loadl_epi64(reinterpret_cast<const __m128i*>(places_there.data())))),
        bias(_mm256_set1_epi32(static_cast<int>(bias_there))) {}

  [[DYNFILTER_AVX512, gnu::always_inline]] std::uint16_t operator()(const DepthRows<float>& rows,
                                                                    std::ptrdiff_t x) const {
    const __m256i outer = _mm256_inserti128_si256(
        _mm256_castsi128_si256(four_of(rows.upper + x - 1)), four_of(rows.lower + x - 1), 1);
    const __m256i middle = _mm256_castsi128_si256(four_of(rows.middle + x - 1));
    const __m256i neighbours = _mm256_permutex2var_epi32(outer, places, middle);
    const __m256i centre = _mm256_set1_epi32(static_cast<int>(depth_bits(rows.middle[x])));
    return _mm256_cmpgt_epu32_mask(_mm256_add_epi32(neighbours, bias),
                                   _mm256_add_epi32(centre, bias));
  }

  [[DYNFILTER_AVX512, gnu::always_inline]] static __m128i four_of(const float* first) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(first));
  }

  __m256i places, bias;
};

#undef DYNFILTER_AVX512

}  // namespace dynfilter::detail

#endif  // DYNFILTER_HAS_X86_KERNELS

#endif  // DYNFILTER_DETAIL_DEPTH_LBP_POINTS_AVX512_HPP
