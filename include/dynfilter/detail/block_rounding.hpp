// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The pixels of 64 positions at once, as nearest_pixel gives each.

#ifndef DYNFILTER_DETAIL_BLOCK_ROUNDING_HPP
#define DYNFILTER_DETAIL_BLOCK_ROUNDING_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/detail/narrow_pixels.hpp"
#include "dynfilter/features.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <immintrin.h>
#endif

namespace dynfilter::detail {

/// Positions of which each stands so many bytes behind the one before.
struct Positions {
  const unsigned char* first;
  std::size_t stride;

  Positions(const unsigned char* first_byte, std::size_t stride_bytes)
      : first(first_byte), stride(stride_bytes) {}
  explicit Positions(const FeaturesView& features)
      : Positions(static_cast<const unsigned char*>(features.data()), features.stride_bytes()) {}

  Positions from(std::size_t i) const { return {first + i * stride, stride}; }
  cv::Point2f operator[](std::size_t i) const {
    cv::Point2f position;
    std::memcpy(&position, first + i * stride, sizeof position);
    return position;
  }
};

/// Any positions, one by one.
inline void round_plainly(const Positions& positions, std::size_t count, cv::Point* pixels,
                          NarrowBlock& narrow) {
  for (std::size_t i = 0; i < count; ++i) {
    pixels[i] = nearest_pixel(positions[i]);
    narrow.pixels[i] = narrowed(pixels[i]);
  }
}

#if DYNFILTER_HAS_X86_KERNELS

// A block of positions that all round to pixels of 16 bits; false if one of them does not. Without
// their signs floats sort like the integers of their bits, NaN above all others.

constexpr int no_sign_bit = 0x7FFFFFFF;
constexpr int bits_of_32767 = 0x46FFFE00;

inline bool round_ordinary_sse2(const Positions& positions, cv::Point* pixels,
                                NarrowBlock& narrow) {
  __m128i extraordinary = _mm_setzero_si128();
  const unsigned char* from = positions.first;
  const auto next_two = [&] {
    __m128 two = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(from));
    two = _mm_loadh_pi(two, reinterpret_cast<const __m64*>(from + positions.stride));
    from += 2 * positions.stride;
    const __m128i size = _mm_and_si128(_mm_castps_si128(two), _mm_set1_epi32(no_sign_bit));
    extraordinary =
        _mm_or_si128(extraordinary, _mm_cmpgt_epi32(size, _mm_set1_epi32(bits_of_32767)));
    // What round_half_up does; -1 stands for true.
    const __m128i truncated = _mm_cvttps_epi32(two);
    const __m128 rest = _mm_sub_ps(two, _mm_cvtepi32_ps(truncated));
    const __m128i is_more = _mm_castps_si128(_mm_cmpge_ps(rest, _mm_set1_ps(0.5F)));
    const __m128i is_less = _mm_castps_si128(_mm_cmplt_ps(rest, _mm_set1_ps(-0.5F)));
    return _mm_add_epi32(_mm_sub_epi32(truncated, is_more), is_less);
  };
  for (std::size_t i = 0; i < block_size; i += 4) {
    const __m128i low = next_two(), high = next_two();
    _mm_storeu_si128(reinterpret_cast<__m128i*>(pixels + i), low);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(pixels + i + 2), high);
    _mm_store_si128(reinterpret_cast<__m128i*>(narrow.pixels + i), _mm_packs_epi32(low, high));
  }
  return _mm_movemask_epi8(extraordinary) == 0;
}

[[gnu::target("avx2")]] inline bool round_ordinary_avx2(const Positions& positions,
                                                        cv::Point* pixels, NarrowBlock& narrow) {
  __m256i extraordinary = _mm256_setzero_si256();
  const unsigned char* from = positions.first;
  const std::size_t stride = positions.stride;
  for (std::size_t i = 0; i < block_size; i += 8) {
    __m256i rounded[2];
    for (__m256i& four : rounded) {
      __m128 low = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(from));
      low = _mm_loadh_pi(low, reinterpret_cast<const __m64*>(from + stride));
      from += 2 * stride;
      __m128 high = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(from));
      high = _mm_loadh_pi(high, reinterpret_cast<const __m64*>(from + stride));
      from += 2 * stride;
      const __m256 all = _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
      const __m256i size =
          _mm256_and_si256(_mm256_castps_si256(all), _mm256_set1_epi32(no_sign_bit));
      extraordinary = _mm256_or_si256(extraordinary,
                                      _mm256_cmpgt_epi32(size, _mm256_set1_epi32(bits_of_32767)));
      const __m256i truncated = _mm256_cvttps_epi32(all);
      const __m256 rest = _mm256_sub_ps(all, _mm256_cvtepi32_ps(truncated));
      const __m256i is_more =
          _mm256_castps_si256(_mm256_cmp_ps(rest, _mm256_set1_ps(0.5F), _CMP_GE_OQ));
      const __m256i is_less =
          _mm256_castps_si256(_mm256_cmp_ps(rest, _mm256_set1_ps(-0.5F), _CMP_LT_OQ));
      four = _mm256_add_epi32(_mm256_sub_epi32(truncated, is_more), is_less);
    }
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(pixels + i), rounded[0]);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(pixels + i + 4), rounded[1]);
    // Packing works in either half of a register on its own.
    const __m256i eight = _mm256_permute4x64_epi64(_mm256_packs_epi32(rounded[0], rounded[1]),
                                                   _MM_SHUFFLE(3, 1, 2, 0));
    _mm256_store_si256(reinterpret_cast<__m256i*>(narrow.pixels + i), eight);
  }
  return _mm256_testz_si256(extraordinary, extraordinary) != 0;
}

#endif

/// A block of positions, by the best instructions up to those of a set.
inline void round_full_block(const Positions& positions, [[maybe_unused]] InstructionSet best,
                             cv::Point* pixels, NarrowBlock& narrow) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx2) {
    if (round_ordinary_avx2(positions, pixels, narrow)) return;
  } else if (best >= InstructionSet::sse2) {
    if (round_ordinary_sse2(positions, pixels, narrow)) return;
  }
#endif
  round_plainly(positions, block_size, pixels, narrow);
}

/// As many positions as there are, at most a block of them. There must be room for a block of
/// pixels.
inline void round_block(const Positions& positions, std::size_t count, InstructionSet best,
                        cv::Point* pixels, NarrowBlock& narrow) {
  if (count >= block_size) return round_full_block(positions, best, pixels, narrow);
  std::array<cv::Point2f, block_size> full{};
  for (std::size_t i = 0; i < count; ++i) full[i] = positions[i];
  const auto* first = reinterpret_cast<const unsigned char*>(full.data());
  round_full_block({first, sizeof full[0]}, best, pixels, narrow);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_BLOCK_ROUNDING_HPP
