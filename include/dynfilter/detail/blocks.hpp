// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Points in blocks of 64: tests of a whole block at once, and sets of its points as bits. The loops
// have a constant number of steps and no branch, so that compilers make vector code of them at -O2,
// for any instruction set.

#ifndef DYNFILTER_DETAIL_BLOCKS_HPP
#define DYNFILTER_DETAIL_BLOCKS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
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

/// The lowest `count` bits, all 64 of them if it is more.
constexpr std::uint64_t bits_below(std::size_t count) {
  return count < block_size ? (std::uint64_t{1} << count) - 1 : ~std::uint64_t{0};
}

inline std::size_t count_bits(std::uint64_t bits) {
  return static_cast<std::size_t>(__builtin_popcountll(bits));
}

/// A coordinate of 16 bits that no narrow interval holds: it, and its opposite, stand for all
/// beyond.
constexpr int outside_narrow = -32767;

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
  bool is_narrow() const { return first_ > outside_narrow && last_ < -outside_narrow; }

  /// Only of narrow ones that are not empty.
  std::int16_t narrow_first() const { return static_cast<std::int16_t>(first_); }
  std::int16_t narrow_last() const { return static_cast<std::int16_t>(last_); }

 private:
  std::int64_t first_;
  std::int64_t last_;
};

inline std::int16_t narrowed(int coordinate) {
  return static_cast<std::int16_t>(std::clamp(coordinate, outside_narrow, -outside_narrow));
}

/// Whether the positions of a block, x and y in turn, round to pixels of 16 bits.
inline bool are_ordinary(const float* coordinates) {
  // Without their signs floats sort like the integers of their bits, NaN above all others.
  std::int32_t all_below = -1;
  for (std::size_t j = 0; j < 2 * block_size; ++j) {
    constexpr std::int32_t bits_of_32767 = 0x46FFFE00;
    std::int32_t bits = 0;
    std::memcpy(&bits, coordinates + j, sizeof bits);
    all_below &= (bits & 0x7FFFFFFF) - bits_of_32767 - 1;  // negative: not above
  }
  return all_below < 0;
}

/// The bit that stands for point `k` of a block in block_inside's answer. Eight bytes of flags are
/// taken for one word, and of the eight words the one that holds point k keeps its bit k / 8.
constexpr std::size_t bit_of_point(std::size_t k) {
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
  return 8 * (7 - k % 8) + k / 8;
#else
  return 8 * (k % 8) + k / 8;
#endif
}

constexpr std::array<std::uint8_t, block_size> flags_of_points() {
  std::array<std::uint8_t, block_size> flags{};
  for (std::size_t k = 0; k < block_size; ++k) flags[k] = static_cast<std::uint8_t>(1U << k / 8);
  return flags;
}

/// Which of 64 points lie in the rectangle of two narrow intervals: bit_of_point tells the bit of
/// each.
inline std::uint64_t block_inside(const std::int16_t* x, const std::int16_t* y,
                                  const Interval& columns, const Interval& rows) {
  static constexpr std::array<std::uint8_t, block_size> flags = flags_of_points();
  const auto from = [](std::int16_t first, std::int16_t coordinate) {
    return static_cast<std::uint16_t>(coordinate - first);  // what lies before wraps to the end
  };
  const std::int16_t left = columns.narrow_first(), top = rows.narrow_first();
  const std::uint16_t width = from(left, columns.narrow_last());
  const std::uint16_t height = from(top, rows.narrow_last());
  std::uint16_t all_bits_inside[block_size];
  for (std::size_t k = 0; k < block_size; ++k) {
    const std::uint16_t in_columns = from(left, x[k]) <= width ? 0xFFFF : 0;
    const std::uint16_t in_rows = from(top, y[k]) <= height ? 0xFFFF : 0;
    all_bits_inside[k] = in_columns & in_rows;
  }
  std::uint8_t flagged[block_size];
  for (std::size_t k = 0; k < block_size; ++k) {
    flagged[k] = static_cast<std::uint8_t>(all_bits_inside[k] & flags[k]);
  }
  std::uint64_t bits = 0;
  for (std::size_t word = 0; word < 8; ++word) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, flagged + 8 * word, sizeof eight);
    bits |= eight;
  }
  return bits;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_BLOCKS_HPP
