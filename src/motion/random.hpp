// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Reproducible random numbers.

#ifndef DYNFILTER_SRC_MOTION_RANDOM_HPP
#define DYNFILTER_SRC_MOTION_RANDOM_HPP

#include <cstddef>
#include <cstdint>

namespace dynfilter::detail {

/// Returns a number whose bits all depend on all bits of `bits`, one to one (the finaliser of G.
/// Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", 2014).
inline std::uint64_t mixed(std::uint64_t bits) {
  bits += 0x9E3779B97F4A7C15U;
  bits = (bits ^ (bits >> 30U)) * 0xBF58476D1CE4E5B9U;
  bits = (bits ^ (bits >> 27U)) * 0x94D049BB133111EBU;
  return bits ^ (bits >> 31U);
}

/// Sequence of random numbers; equal seeds give equal sequences.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(mixed(seed)) {}

  /// Returns a number below `count`, which is above 0 and far below 2^32.
  std::size_t below(std::size_t count) {
    state_ += 0x9E3779B97F4A7C15U;
    return static_cast<std::size_t>(((mixed(state_) >> 32U) * count) >> 32U);
  }

 private:
  std::uint64_t state_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_RANDOM_HPP
