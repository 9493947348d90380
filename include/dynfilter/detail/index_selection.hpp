// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Those of 64 indices that bits are set for.

#ifndef DYNFILTER_DETAIL_INDEX_SELECTION_HPP
#define DYNFILTER_DETAIL_INDEX_SELECTION_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/instruction_set.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <immintrin.h>
#endif

namespace dynfilter::detail {

// What follows puts the selected ones of a block of indices, in their order, where `selected`
// points, and returns how many they are. That may be where the block begins, or before. What lies
// behind them, up to a block, may be overwritten, and the whole block is read.

inline std::size_t select_indices_plainly(const std::uint32_t* indices, std::uint64_t bits,
                                          std::uint32_t* selected) {
  std::size_t count = 0;
  for_each_bit(bits, [&](std::size_t bit) { selected[count++] = indices[bit]; });
  return count;
}

#if DYNFILTER_HAS_X86_KERNELS

[[gnu::target("avx512f,popcnt")]] inline std::size_t select_indices_avx512(
    const std::uint32_t* indices, std::uint64_t bits, std::uint32_t* selected) {
  constexpr std::size_t lanes = 16;
  __m512i parts[block_size / lanes];
  for (std::size_t k = 0; k < block_size / lanes; ++k) {
    parts[k] = _mm512_loadu_si512(indices + k * lanes);
  }
  std::size_t count = 0;
  for (const __m512i part : parts) {
    const auto mask = static_cast<__mmask16>(bits);
    _mm512_storeu_si512(selected + count, _mm512_maskz_compress_epi32(mask, part));
    count += static_cast<std::size_t>(_mm_popcnt_u32(mask));
    bits >>= lanes;
  }
  return count;
}

#endif

/// By the best instructions up to those of a set.
inline std::size_t select_indices(const std::uint32_t* indices, std::uint64_t bits,
                                  [[maybe_unused]] InstructionSet best, std::uint32_t* selected) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx512) return select_indices_avx512(indices, bits, selected);
#endif
  return select_indices_plainly(indices, bits, selected);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_INDEX_SELECTION_HPP
