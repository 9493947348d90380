// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_RECTANGLE_TABLE_HPP
#define DYNFILTER_DETAIL_RECTANGLE_TABLE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Tells which of up to 64 rectangles a pixel may lie in, without asking each: the image is cut
/// into strips, both ways, and each strip knows the rectangles that it meets.
class RectangleTable {
 public:
  static constexpr std::size_t most_rectangles = 64;

  explicit RectangleTable(const cv::Size& image)
      : column_shift_(shift_for(image.width)), row_shift_(shift_for(image.height)) {}

  /// `k` is the rectangle's number, below 64. It must lie in the image, or be empty.
  void add(std::size_t k, const cv::Rect& rectangle) {
    if (rectangle.empty()) return;
    const std::uint64_t bit = std::uint64_t{1} << k;
    add(columns_, column_shift_, rectangle.x, rectangle.width, bit);
    add(rows_, row_shift_, rectangle.y, rectangle.height, bit);
  }

  /// Of any pixel, wherever it lies: bit k is set for each rectangle k that holds it, and for some
  /// that end less than a strip away.
  std::uint64_t candidates(cv::Point pixel) const {
    return columns_[strip_of(pixel.x, column_shift_)] & rows_[strip_of(pixel.y, row_shift_)];
  }

 private:
  static constexpr unsigned strips = 128;
  using Strips = std::array<std::uint64_t, strips + 1>;  // the last: beyond the image

  /// Strips are 2^shift pixels wide.
  static unsigned shift_for(int length) {
    unsigned shift = 0;
    while (static_cast<unsigned>(std::max(length, 1) - 1) >> shift >= strips) ++shift;
    return shift;
  }

  /// What is negative wraps to the far end.
  static unsigned strip_of(int coordinate, unsigned shift) {
    return std::min(static_cast<unsigned>(coordinate) >> shift, strips);
  }

  static void add(Strips& along, unsigned shift, int first, int length, std::uint64_t bit) {
    const unsigned last = strip_of(first + length - 1, shift);
    for (unsigned strip = strip_of(first, shift); strip <= last; ++strip) along[strip] |= bit;
  }

  unsigned column_shift_, row_shift_;
  Strips columns_{}, rows_{};
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_RECTANGLE_TABLE_HPP
