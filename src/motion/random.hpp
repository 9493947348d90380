// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Reproducible random numbers.

#pragma once

#include <cstddef>
#include <cstdint>

#include "dynfilter/detail/mixed_bits.hpp"

namespace dynfilter::detail {

/// Sequence of random numbers; equal seeds give equal sequences.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(mixed_bits(seed)) {}

  /// Returns a number below `count`, which is above 0 and far below 2^32.
  std::size_t below(std::size_t count) {
    state_ += 0x9E3779B97F4A7C15U;
    return static_cast<std::size_t>(((mixed_bits(state_) >> 32U) * count) >> 32U);
  }

 private:
  std::uint64_t state_;
};

}  // namespace dynfilter::detail
