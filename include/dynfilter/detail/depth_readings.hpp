// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a depth image has at some pixels, laid out so that 64 of them are tested at once.

#ifndef DYNFILTER_DETAIL_DEPTH_READINGS_HPP
#define DYNFILTER_DETAIL_DEPTH_READINGS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/instruction_set.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <immintrin.h>
#endif

namespace dynfilter::detail {

/// What stands in the place of the code of a pixel without eight neighbours.
constexpr std::uint16_t no_code = 0xFFFF;

/// Memory that is kept between frames, of whole blocks.
struct DepthReadings {
  std::vector<std::uint32_t> depth_bits;  ///< see DepthBits; 0 outside the image
  std::vector<std::uint16_t> codes;       ///< of no account where there is no depth

  void reserve(std::size_t pixels) {
    const std::size_t room = blocks_for(pixels) * block_size;
    if (codes.size() >= room) return;
    depth_bits.resize(room);
    codes.resize(room);
  }
};

// What follows tells which of a block of numbers lie in a range, as bits.

/// In a loop of a constant number of steps, without a branch, of which compilers make vector code.
template <class Number>
std::uint64_t bits_in_range_plainly(const Number* numbers, const NumberRange& range) {
  const auto first = static_cast<Number>(range.first), count = static_cast<Number>(range.count);
  std::uint8_t is_inside[block_size];
  for (std::size_t k = 0; k < block_size; ++k) {
    is_inside[k] = static_cast<Number>(numbers[k] - first) < count ? 1 : 0;
  }
  return bits_of_bytes(is_inside);
}

#if DYNFILTER_HAS_X86_KERNELS

[[gnu::target("avx512f,avx512bw")]] inline std::uint64_t bits_in_range_avx512(
    const std::uint32_t* numbers, const NumberRange& range) {
  constexpr std::size_t lanes = 16;
  const __m512i first = _mm512_set1_epi32(static_cast<int>(range.first));
  const __m512i count = _mm512_set1_epi32(static_cast<int>(range.count));
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < block_size; k += lanes) {
    const __m512i beyond_first = _mm512_sub_epi32(_mm512_loadu_si512(numbers + k), first);
    bits |= std::uint64_t{_mm512_cmplt_epu32_mask(beyond_first, count)} << k;
  }
  return bits;
}

[[gnu::target("avx512f,avx512bw")]] inline std::uint64_t bits_in_range_avx512(
    const std::uint16_t* numbers, const NumberRange& range) {
  constexpr std::size_t lanes = 32;
  const __m512i first = _mm512_set1_epi16(static_cast<short>(range.first));
  const __m512i count = _mm512_set1_epi16(static_cast<short>(range.count));
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < block_size; k += lanes) {
    const __m512i beyond_first = _mm512_sub_epi16(_mm512_loadu_si512(numbers + k), first);
    bits |= std::uint64_t{_mm512_cmplt_epu16_mask(beyond_first, count)} << k;
  }
  return bits;
}

#endif

/// By the best instructions up to those of a set. The range's numbers must be some of the type's.
template <class Number>
std::uint64_t bits_in_range(const Number* numbers, const NumberRange& range,
                            [[maybe_unused]] InstructionSet best) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx512) return bits_in_range_avx512(numbers, range);
#endif
  return bits_in_range_plainly(numbers, range);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_READINGS_HPP
