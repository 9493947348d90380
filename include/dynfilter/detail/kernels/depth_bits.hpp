// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Portable code of one pixel, and the helpers that all kernels share.

#ifndef DYNFILTER_DETAIL_KERNELS_DEPTH_BITS_HPP
#define DYNFILTER_DETAIL_KERNELS_DEPTH_BITS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "dynfilter/detail/kernels/instruction_set.hpp"

namespace dynfilter::detail {

/// Bits of a depth as an unsigned integer. "No depth" is 0 or at least `first_beyond`: positive
/// floats sort like their bits, infinity and NaN lie above them, and negative floats above those.
template <class Depth>
struct DepthBits;

template <>
struct DepthBits<std::uint16_t> {
  using Type = std::uint16_t;
  static constexpr std::uint32_t first_beyond = 0x10000;
};

template <>
struct DepthBits<float> {
  using Type = std::uint32_t;
  static constexpr std::uint32_t first_beyond = 0x7F800000;  // infinity
};

template <class Depth>
typename DepthBits<Depth>::Type depth_bits(Depth depth) {
  typename DepthBits<Depth>::Type bits;
  static_assert(sizeof bits == sizeof depth, "the same bits");
  std::memcpy(&bits, &depth, sizeof bits);
  return bits;
}

/// Whether these bits are a valid depth: not 0, negative, NaN or infinite.
template <class Depth>
bool are_of_depth(std::uint32_t bits) {
  return bits - 1 < DepthBits<Depth>::first_beyond - 1;
}

template <class Depth>
bool has_depth(Depth depth) {
  return are_of_depth<Depth>(depth_bits(depth));
}

/// Returns the bias to add to the bits of a depth, modulo their width. Biased depths keep their
/// order as unsigned integers, and all values of "no depth" lie below every depth, so that a
/// neighbour without depth counts as nearer.
template <class Depth>
constexpr typename DepthBits<Depth>::Type depth_bias() {
  return static_cast<typename DepthBits<Depth>::Type>(0U - DepthBits<Depth>::first_beyond);
}

/// Three adjacent rows of a depth image.
template <class Depth>
struct DepthRows {
  const Depth* upper;
  const Depth* middle;
  const Depth* lower;
};

/// Returns the code of a pixel with depth; bit k is neighbour k, clockwise from the top-left one.
template <class Depth>
[[gnu::always_inline]] inline std::uint8_t clockwise_code(const DepthRows<Depth>& rows,
                                                          std::ptrdiff_t x,
                                                          typename DepthBits<Depth>::Type bias) {
  using Bits = typename DepthBits<Depth>::Type;
  const auto biased = [bias](Depth depth) { return static_cast<Bits>(depth_bits(depth) + bias); };
  const Bits centre = biased(rows.middle[x]);
  // A shift instead of a condition, because depths are unpredictable for branches.
  const auto bit = [&](Depth neighbour, unsigned position) {
    return static_cast<unsigned>(biased(neighbour) > centre) << position;
  };
  return static_cast<std::uint8_t>(bit(rows.upper[x - 1], 0) | bit(rows.upper[x], 1) |
                                   bit(rows.upper[x + 1], 2) | bit(rows.middle[x + 1], 3) |
                                   bit(rows.lower[x + 1], 4) | bit(rows.lower[x], 5) |
                                   bit(rows.lower[x - 1], 6) | bit(rows.middle[x - 1], 7));
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_KERNELS_DEPTH_BITS_HPP
