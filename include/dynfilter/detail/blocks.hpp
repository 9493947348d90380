// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features in blocks of 64, and sets of a block's features as bits.

#ifndef DYNFILTER_DETAIL_BLOCKS_HPP
#define DYNFILTER_DETAIL_BLOCKS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "dynfilter/detail/instruction_set.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <emmintrin.h>
#endif

namespace dynfilter::detail {

constexpr std::size_t block_size = 64;

constexpr std::size_t blocks_for(std::size_t features) {
  return (features + block_size - 1) / block_size;
}

/// The index of the lowest bit that is set. There must be one.
inline std::size_t lowest_bit(std::uint64_t bits) {
  return static_cast<unsigned>(__builtin_ctzll(bits));
}

/// Calls the action with the index of each bit that is set, in ascending order.
template <class Action>
void for_each_bit(std::uint64_t bits, const Action& action) {
  for (; bits != 0; bits &= bits - 1) action(lowest_bit(bits));
}

/// The lowest `count` bits, all 64 of them if it is more.
constexpr std::uint64_t bits_below(std::size_t count) {
  return count < block_size ? (std::uint64_t{1} << count) - 1 : ~std::uint64_t{0};
}

inline std::size_t count_bits(std::uint64_t bits) {
  return static_cast<std::size_t>(__builtin_popcountll(bits));
}

/// Which of a block of bytes are not 0.
inline std::uint64_t bits_of_bytes(const std::uint8_t* bytes) {
  std::uint64_t bits = 0;
#if DYNFILTER_HAS_X86_KERNELS
  for (unsigned k = 0; k < block_size; k += 16) {
    const __m128i sixteen = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes + k));
    const int are_zero = _mm_movemask_epi8(_mm_cmpeq_epi8(sixteen, _mm_setzero_si128()));
    bits |= std::uint64_t{static_cast<std::uint32_t>(are_zero)} << k;
  }
  return ~bits;
#else
  constexpr std::uint64_t low_seven = 0x7F7F7F7F7F7F7F7FU;
  for (unsigned k = 0; k < block_size; k += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, bytes + k, sizeof eight);
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    eight = __builtin_bswap64(eight);
#endif
    // A carry into the highest bit of a byte says that one of the others is set.
    eight = ((eight | ((eight & low_seven) + low_seven)) & ~low_seven) >> 7U;
    // Shifts the bit of byte i, which is bit 8 i, to bit 56 + i, and adds.
    bits |= (eight * 0x0102040810204080U >> 56U) << k;
  }
  return bits;
#endif
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_BLOCKS_HPP
