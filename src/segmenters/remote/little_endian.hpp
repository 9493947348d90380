// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_REMOTE_LITTLE_ENDIAN_HPP
#define DYNFILTER_SRC_SEGMENTERS_REMOTE_LITTLE_ENDIAN_HPP

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace dynfilter::detail {

template <std::size_t Size>
using UnsignedOfSize = std::conditional_t<
    Size == 1, std::uint8_t,
    std::conditional_t<Size == 2, std::uint16_t,
                       std::conditional_t<Size == 4, std::uint32_t, std::uint64_t>>>;

/// Appends a number, least significant byte first on any host. Floating-point numbers are IEEE 754.
template <class Number>
void append_little_endian(std::vector<std::uint8_t>& bytes, Number number) {
  UnsignedOfSize<sizeof(Number)> bits = 0;
  std::memcpy(&bits, &number, sizeof number);
  for (std::size_t i = 0; i < sizeof number; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(std::uint64_t{bits} >> (8 * i)));
  }
}

/// Returns the number at `bytes`, of which sizeof(Number) must be there.
template <class Number>
Number read_little_endian(const std::uint8_t* bytes) {
  std::uint64_t wide = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) wide |= std::uint64_t{bytes[i]} << (8 * i);
  const auto bits = static_cast<UnsignedOfSize<sizeof(Number)>>(wide);
  Number number;
  std::memcpy(&number, &bits, sizeof number);
  return number;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_REMOTE_LITTLE_ENDIAN_HPP
