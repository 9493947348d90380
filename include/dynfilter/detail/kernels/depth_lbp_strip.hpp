// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Input of the kernels for dense D-LBP, and the kernel in plain C++.

#ifndef DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_STRIP_HPP
#define DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_STRIP_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

#include "dynfilter/detail/kernels/depth_bits.hpp"

namespace dynfilter::detail {

/// Pixels that all have eight neighbours, in adjacent rows, and the destination of their codes.
/// Strides are in elements.
template <class Depth>
struct DepthLbpStrip {
  const Depth* depth;
  std::ptrdiff_t depth_stride;
  std::uint8_t* codes;
  std::ptrdiff_t codes_stride;
  std::ptrdiff_t rows;
  std::ptrdiff_t columns;
};

template <class Depth>
struct DepthLbpRule {
  using Bits = typename DepthBits<Depth>::Type;

  std::array<std::uint8_t, 8> bits;  ///< bits of the neighbours, clockwise from the top-left one
  Bits bias;                         ///< see depth_bias

  /// Number that removes the bias and subtracts 1: valid depths then lie below `depths`.
  Bits unbias() const { return static_cast<Bits>(~bias); }
  static constexpr Bits depths = static_cast<Bits>(DepthBits<Depth>::first_beyond - 1);

  /// Number that maps unsigned to signed order, for signed comparisons.
  static constexpr Bits sign = static_cast<Bits>(Bits{1} << (8 * sizeof(Bits) - 1));
  static constexpr Bits signed_depths = static_cast<Bits>(depths ^ sign);
  Bits signed_bias() const { return static_cast<Bits>(bias ^ sign); }
};

/// Computes the codes of a strip in plain C++, without a branch on a depth.
template <class Depth>
void depth_lbp_portable(const DepthLbpStrip<Depth>& strip, const DepthLbpRule<Depth>& rule) {
  std::array<std::uint8_t, 256> arrangement{};  // from clockwise bits to the weights
  for (std::size_t code = 1; code < 256; ++code) {
    for (std::size_t k = 0; k < 8; ++k) {
      const auto bit = static_cast<std::uint8_t>((code >> k & 1U) << rule.bits[k]);
      arrangement[code] = static_cast<std::uint8_t>(arrangement[code] | bit);
    }
  }
  for (std::ptrdiff_t y = 0; y < strip.rows; ++y) {
    const Depth* middle = strip.depth + y * strip.depth_stride;
    const DepthRows<Depth> rows = {middle - strip.depth_stride, middle,
                                   middle + strip.depth_stride};
    std::uint8_t* codes = strip.codes + y * strip.codes_stride;
    for (std::ptrdiff_t x = 0; x < strip.columns; ++x) {
      const std::uint8_t code = arrangement[clockwise_code(rows, x, rule.bias)];
      codes[x] = has_depth(middle[x]) ? code : std::uint8_t{0};
    }
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_STRIP_HPP
