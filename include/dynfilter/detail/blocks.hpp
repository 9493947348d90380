// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features in blocks of 64: tests of a whole block at once, and sets of its features as bits. The
// loops have a constant number of steps and no branch, so that compilers make vector code of them
// at -O2, for any instruction set.

#ifndef DYNFILTER_DETAIL_BLOCKS_HPP
#define DYNFILTER_DETAIL_BLOCKS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

namespace dynfilter::detail {

constexpr std::size_t block_size = 64;

constexpr std::size_t blocks_for(std::size_t features) {
  return (features + block_size - 1) / block_size;
}

/// Calls the action with the index of each bit that is set, in ascending order.
template <class Action>
void for_each_bit(std::uint64_t bits, const Action& action) {
  for (; bits != 0; bits &= bits - 1) action(static_cast<std::size_t>(__builtin_ctzll(bits)));
}

/// The index of the highest bit that is set; one must be.
inline std::size_t last_bit(std::uint64_t bits) {
  return 63 - static_cast<std::size_t>(__builtin_clzll(bits));
}

inline std::size_t count_bits(std::uint64_t bits) {
  return static_cast<std::size_t>(__builtin_popcountll(bits));
}

/// The coordinates first to last, both included, along one axis of a rectangle.
class Interval {
 public:
  Interval(std::int64_t first, std::int64_t length)
      // The smallest int is the coordinate of what lies nowhere.
      : first_(std::max(first, std::numeric_limits<int>::min() + std::int64_t{1})),
        last_(first + length - 1) {}

  bool empty() const { return first_ > last_; }
  bool contains(int coordinate) const { return first_ <= coordinate && coordinate <= last_; }

  /// Whether coordinates that are cut off at the ends of 16 bits tell the same: those that were
  /// stand at the ends, which the interval does not reach.
  bool is_narrow() const {
    using Limits = std::numeric_limits<std::int16_t>;
    return first_ > Limits::min() && last_ < Limits::max();
  }

  /// Only of narrow ones that are not empty.
  std::int16_t narrow_first() const { return static_cast<std::int16_t>(first_); }
  std::int16_t narrow_last() const { return static_cast<std::int16_t>(last_); }

 private:
  std::int64_t first_;
  std::int64_t last_;
};

/// Cut off at the ends of 16 bits.
inline std::int16_t narrowed(int coordinate) {
  using Limits = std::numeric_limits<std::int16_t>;
  return static_cast<std::int16_t>(std::clamp<int>(coordinate, Limits::min(), Limits::max()));
}

/// The bits of 64 flags, each 0 or -1 (all bits).
inline std::uint64_t bits_of(const std::int8_t* flags) {
  // In every group of eight a flag keeps one bit, another one each, and their sum is the eight.
  static constexpr std::uint8_t weights[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  std::uint64_t weight = 0, bits = 0;
  std::memcpy(&weight, weights, sizeof weight);
  for (std::size_t group = 0; group < 8; ++group) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, flags + 8 * group, sizeof eight);
    bits |= ((eight & weight) * 0x0101010101010101U >> 56U) << (8 * group);
  }
  return bits;
}

/// Which of 64 points lie in the rectangle of two narrow intervals.
inline std::uint64_t block_inside(const std::int16_t* x, const std::int16_t* y,
                                  const Interval& columns, const Interval& rows) {
  const std::int16_t left = columns.narrow_first(), right = columns.narrow_last();
  const std::int16_t top = rows.narrow_first(), bottom = rows.narrow_last();
  std::int8_t flags[block_size];
  for (std::size_t j = 0; j < block_size; ++j) {
    const bool is_inside = (x[j] >= left) & (x[j] <= right) & (y[j] >= top) & (y[j] <= bottom);
    flags[j] = static_cast<std::int8_t>(is_inside ? -1 : 0);
  }
  return bits_of(flags);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_BLOCKS_HPP
