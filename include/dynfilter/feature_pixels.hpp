// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_PIXELS_HPP
#define DYNFILTER_FEATURE_PIXELS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/features.hpp"

namespace dynfilter {

/// The pixels of a frame's features, rounded once and laid out so that blocks of 64 of them are
/// compared with a rectangle at once: stages ask for each instance which features are in its box.
///
/// A set of features of a block is a 64-bit word: bit j is feature 64 * block + j.
class FeaturePixels {
 public:
  /// Reads the features' pixels, reusing memory. O(features).
  void read(FeaturesView features) {
    view_ = features;
    const std::size_t padded = detail::blocks_for(features.size()) * detail::block_size;
    if (pixels_.size() < padded) {
      pixels_.resize(padded);
      narrow_x_.resize(padded);
      narrow_y_.resize(padded);
    }
    for (std::size_t block = 0; block < blocks(); ++block) read_block(features, block);
  }

  std::size_t size() const { return view_.size(); }
  std::size_t blocks() const { return detail::blocks_for(size()); }

  /// Whether these are the pixels of that view, as far as its place in memory tells.
  bool are_of(const FeaturesView& features) const { return view_.is_same_view(features); }

  /// As FeaturesView::pixel gives it. i must be below size().
  cv::Point operator[](std::size_t i) const { return pixels_[i]; }

  /// Those of a block whose pixel lies in the rectangle, wherever that lies. O(64).
  std::uint64_t inside(std::size_t block, const cv::Rect& rectangle) const {
    return inside(block, detail::Interval(rectangle.x, rectangle.width),
                  detail::Interval(rectangle.y, rectangle.height));
  }

  std::uint64_t inside(std::size_t block, const detail::Interval& columns,
                       const detail::Interval& rows) const {
    if (columns.empty() || rows.empty()) return 0;
    const std::size_t first = block * detail::block_size;
    if (columns.is_narrow() && rows.is_narrow()) {
      return detail::block_inside(&narrow_x_[first], &narrow_y_[first], columns, rows);
    }
    std::uint64_t inside = 0;
    for (std::size_t j = 0; j < detail::block_size; ++j) {
      const cv::Point pixel = pixels_[first + j];
      const bool is_inside = columns.contains(pixel.x) && rows.contains(pixel.y);
      inside |= std::uint64_t{is_inside} << j;
    }
    return inside;
  }

 private:
  void read_block(FeaturesView features, std::size_t block) {
    const std::size_t first = block * detail::block_size;
    const std::size_t count = std::min(features.size() - first, detail::block_size);
    float coordinates[2 * detail::block_size];
    features.copy_positions(first, count, coordinates);
    // What pads the last block is no position, so it is in no rectangle.
    std::fill(coordinates + 2 * count, std::end(coordinates),
              std::numeric_limits<float>::quiet_NaN());
    for (float& coordinate : coordinates) coordinate = detail::int_range_or_least(coordinate);
    // A loop of its own: together with the one above, g++ 12 makes branches of it.
    int rounded[2 * detail::block_size];
    for (std::size_t j = 0; j < 2 * detail::block_size; ++j) {
      rounded[j] = detail::round_half_up(coordinates[j]);
    }
    std::int16_t x[detail::block_size], y[detail::block_size];
    for (std::size_t j = 0; j < detail::block_size; ++j) {
      x[j] = detail::narrowed(rounded[2 * j]);
      y[j] = detail::narrowed(rounded[2 * j + 1]);
    }
    std::memcpy(&pixels_[first], rounded, sizeof rounded);
    std::copy(std::begin(x), std::end(x), &narrow_x_[first]);
    std::copy(std::begin(y), std::end(y), &narrow_y_[first]);
  }

  FeaturesView view_;
  std::vector<cv::Point> pixels_;
  // The same, cut off at the ends of 16 bits: half the bytes to compare.
  std::vector<std::int16_t> narrow_x_, narrow_y_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURE_PIXELS_HPP
