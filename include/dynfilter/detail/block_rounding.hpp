// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The pixels of 64 positions at once, as nearest_pixel gives each.

#ifndef DYNFILTER_DETAIL_BLOCK_ROUNDING_HPP
#define DYNFILTER_DETAIL_BLOCK_ROUNDING_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

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

#if DYNFILTER_HAS_X86_KERNELS

// A block of positions. Conversion makes the smallest int of what is no number and of what no int
// can hold, as nearest_pixel does, and packing cuts off at the ends of 16 bits, as narrowed does.

[[gnu::always_inline]] inline __m128 load_two(const unsigned char* from, std::size_t stride) {
  const __m128 low = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(from));
  return _mm_loadh_pi(low, reinterpret_cast<const __m64*>(from + stride));
}

/// What round_half_up does; -1 stands for true.
inline __m128i round_sse2(__m128 numbers) {
  const __m128i truncated = _mm_cvttps_epi32(numbers);
  const __m128 rest = _mm_sub_ps(numbers, _mm_cvtepi32_ps(truncated));
  const __m128i is_more = _mm_castps_si128(_mm_cmpge_ps(rest, _mm_set1_ps(0.5F)));
  const __m128i is_less = _mm_castps_si128(_mm_cmplt_ps(rest, _mm_set1_ps(-0.5F)));
  const __m128i is_beyond =
      _mm_cmpeq_epi32(truncated, _mm_set1_epi32(std::numeric_limits<int>::min()));
  return _mm_add_epi32(truncated, _mm_andnot_si128(is_beyond, _mm_sub_epi32(is_less, is_more)));
}

inline void round_block_sse2(const Positions& positions, cv::Point* pixels, NarrowBlock& narrow,
                             NarrowBounds& bounds) {
  const unsigned char* from = positions.first;
  __m128i least = _mm_load_si128(reinterpret_cast<const __m128i*>(bounds.least));
  __m128i most = _mm_load_si128(reinterpret_cast<const __m128i*>(bounds.most));
  for (std::size_t i = 0; i < block_size; i += 4, from += 4 * positions.stride) {
    const __m128i low = round_sse2(load_two(from, positions.stride));
    const __m128i high = round_sse2(load_two(from + 2 * positions.stride, positions.stride));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(pixels + i), low);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(pixels + i + 2), high);
    const __m128i four = _mm_packs_epi32(low, high);
    _mm_store_si128(reinterpret_cast<__m128i*>(narrow.pixels + i), four);
    least = _mm_min_epi16(least, four);
    most = _mm_max_epi16(most, four);
  }
  _mm_store_si128(reinterpret_cast<__m128i*>(bounds.least), least);
  _mm_store_si128(reinterpret_cast<__m128i*>(bounds.most), most);
}

#define DYNFILTER_AVX2_INLINE [[gnu::target("avx2"), gnu::always_inline]] inline

DYNFILTER_AVX2_INLINE __m256 load_four_avx2(const unsigned char* from, std::size_t stride) {
  const __m128 low = load_two(from, stride);
  const __m128 high = load_two(from + 2 * stride, stride);
  return _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
}

/// Down, and 1 more where the rest is a half or more; what no int can hold has none.
DYNFILTER_AVX2_INLINE __m256i round_avx2(__m256 numbers) {
  const __m256 down = _mm256_floor_ps(numbers);
  const __m256 is_more =
      _mm256_cmp_ps(_mm256_sub_ps(numbers, down), _mm256_set1_ps(0.5F), _CMP_GE_OQ);
  return _mm256_sub_epi32(_mm256_cvttps_epi32(down), _mm256_castps_si256(is_more));
}

[[gnu::target("avx2")]] inline void round_block_avx2(const Positions& positions, cv::Point* pixels,
                                                     NarrowBlock& narrow, NarrowBounds& bounds) {
  const unsigned char* from = positions.first;
  __m256i least = _mm256_load_si256(reinterpret_cast<const __m256i*>(bounds.least));
  __m256i most = _mm256_load_si256(reinterpret_cast<const __m256i*>(bounds.most));
  for (std::size_t i = 0; i < block_size; i += 8, from += 8 * positions.stride) {
    const __m256i low = round_avx2(load_four_avx2(from, positions.stride));
    const __m256i high = round_avx2(load_four_avx2(from + 4 * positions.stride, positions.stride));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(pixels + i), low);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(pixels + i + 4), high);
    // Packing works in either half of a register on its own.
    const __m256i eight =
        _mm256_permute4x64_epi64(_mm256_packs_epi32(low, high), _MM_SHUFFLE(3, 1, 2, 0));
    _mm256_store_si256(reinterpret_cast<__m256i*>(narrow.pixels + i), eight);
    least = _mm256_min_epi16(least, eight);
    most = _mm256_max_epi16(most, eight);
  }
  _mm256_store_si256(reinterpret_cast<__m256i*>(bounds.least), least);
  _mm256_store_si256(reinterpret_cast<__m256i*>(bounds.most), most);
}

#undef DYNFILTER_AVX2_INLINE

#endif

/// A block of positions, by the best instructions up to those of a set.
inline void round_full_block(const Positions& positions, [[maybe_unused]] InstructionSet best,
                             cv::Point* pixels, NarrowBlock& narrow, NarrowBounds& bounds) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx2) return round_block_avx2(positions, pixels, narrow, bounds);
  if (best >= InstructionSet::sse2) return round_block_sse2(positions, pixels, narrow, bounds);
#endif
  for (std::size_t i = 0; i < block_size; ++i) {
    pixels[i] = nearest_pixel(positions[i]);
    narrow.pixels[i] = narrowed(pixels[i]);
    bounds.add(narrow.pixels[i], i % NarrowBounds::lanes);
  }
}

/// As many positions as there are, at least one, at most a block of them. There must be room for a
/// block of pixels. The bounds grow by those of the pixels.
inline void round_block(const Positions& positions, std::size_t count, InstructionSet best,
                        cv::Point* pixels, NarrowBlock& narrow, NarrowBounds& bounds) {
  if (count >= block_size) return round_full_block(positions, best, pixels, narrow, bounds);
  std::array<cv::Point2f, block_size> full;
  for (std::size_t i = 0; i < count; ++i) full[i] = positions[i];
  std::fill(full.begin() + static_cast<std::ptrdiff_t>(count), full.end(), full[0]);
  const auto* first = reinterpret_cast<const unsigned char*>(full.data());
  round_full_block({first, sizeof full[0]}, best, pixels, narrow, bounds);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_BLOCK_ROUNDING_HPP
