// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_PIXELS_HPP
#define DYNFILTER_FEATURE_PIXELS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/features.hpp"

namespace dynfilter {

/// The pixels of a frame's features, rounded once and laid out so that 64 of them are compared with
/// a rectangle at once: stages ask for each instance which features are in its box.
class FeaturePixels {
 public:
  /// Reads the features' pixels, reusing memory. Where many rectangles will be asked for, features
  /// are sorted by their column, so that most of them need not be looked at. O(features).
  void read(FeaturesView features, std::size_t expected_rectangles = 0) {
    view_ = features;
    reserve_blocks(blocks());
    // All are copied before the first is read: reading what was just written in smaller pieces
    // would wait for it.
    features.copy_positions(0, size(), positions_.data());
    const auto padding = static_cast<float>(detail::outside_narrow);
    std::fill(positions_.data() + 2 * size(), positions_.data() + 2 * blocks() * detail::block_size,
              padding);
    for (std::size_t block = 0; block < blocks(); ++block) round_block(block);
    // Sorting costs about as much as comparing all features with four rectangles.
    if (expected_rectangles >= 8) return sort_by_column();
    if (is_sorted_) restore_order();
  }

  std::size_t size() const { return view_.size(); }

  /// Whether these are the pixels of that view, as far as its place in memory tells.
  bool are_of(const FeaturesView& features) const { return view_.is_same_view(features); }

  /// As FeaturesView::pixel gives it. i must be below size().
  cv::Point operator[](std::size_t i) const { return pixels_[i]; }

  /// Calls action(i) for every feature whose pixel lies in the rectangle, wherever that lies, in
  /// an order of its own. O(features / 64), and the features that lie in it.
  template <class Action>
  void for_each_inside(const cv::Rect& rectangle, const Action& action) const {
    for_each_inside(detail::Interval(rectangle.x, rectangle.width),
                    detail::Interval(rectangle.y, rectangle.height), action);
  }

  template <class Action>
  void for_each_inside(const detail::Interval& columns, const detail::Interval& rows,
                       const Action& action) const {
    if (columns.empty() || rows.empty()) return;
    if (!columns.is_narrow() || !rows.is_narrow()) {
      for (std::size_t i = 0; i < size(); ++i) {
        if (columns.contains(pixels_[i].x) && rows.contains(pixels_[i].y)) action(i);
      }
      return;
    }
    const auto [begin, end] = slots_of(columns);
    for (std::size_t first = begin; first < end; first += detail::block_size) {
      const std::uint64_t inside =
          detail::block_inside(&narrow_x_[first], &narrow_y_[first], columns, rows);
      detail::for_each_bit(inside, [&](std::size_t bit) { action(order_[first + bit]); });
    }
  }

 private:
  static constexpr std::size_t most_columns = 64;

  std::size_t blocks() const { return detail::blocks_for(size()); }

  void reserve_blocks(std::size_t blocks) {
    const std::size_t padded = blocks * detail::block_size;
    if (pixels_.size() >= padded) return;
    positions_.resize(2 * padded);
    pixels_.resize(padded);
    narrow_x_.resize(padded);
    narrow_y_.resize(padded);
    sorted_x_.resize(padded);
    sorted_y_.resize(padded);
    order_.resize(padded);
    restore_order();
  }

  void put_into_slot(std::size_t slot, std::size_t feature) {
    const std::size_t point = slot % detail::block_size;
    order_[slot - point + detail::bit_of_point(point)] = static_cast<std::uint32_t>(feature);
  }

  void restore_order() {
    for (std::size_t i = 0; i < order_.size(); ++i) put_into_slot(i, i);
    is_sorted_ = false;
  }

  /// By counting: features of equal columns keep their order.
  void sort_by_column() {
    is_sorted_ = true;
    const int highest = *std::max_element(narrow_x_.begin(), narrow_x_.begin() + signed_size());
    column_shift_ = 0;
    while (std::size_t{1} * static_cast<unsigned>(std::max(highest, 0)) >> column_shift_ >=
           most_columns) {
      ++column_shift_;
    }
    first_slots_.fill(0);
    for (std::size_t i = 0; i < size(); ++i) ++first_slots_[column_of(narrow_x_[i]) + 1];
    for (std::size_t c = 0; c < most_columns; ++c) first_slots_[c + 1] += first_slots_[c];
    std::array<std::uint32_t, most_columns + 1> next = first_slots_;
    for (std::size_t i = 0; i < size(); ++i) {
      const std::size_t slot = next[column_of(narrow_x_[i])]++;
      sorted_x_[slot] = narrow_x_[i];
      sorted_y_[slot] = narrow_y_[i];
      put_into_slot(slot, i);
    }
    const auto padding = static_cast<std::int16_t>(detail::outside_narrow);
    std::fill(sorted_x_.data() + size(), sorted_x_.data() + blocks() * detail::block_size, padding);
    narrow_x_.swap(sorted_x_);
    narrow_y_.swap(sorted_y_);
  }

  /// What lies left of the image is in its first column, what lies right of all features in the
  /// last.
  std::size_t column_of(int x) const {
    const std::size_t column = static_cast<unsigned>(std::max(x, 0)) >> column_shift_;
    return std::min(column, most_columns - 1);
  }

  /// Where the features of these columns are, from the beginning of a block on.
  std::pair<std::size_t, std::size_t> slots_of(const detail::Interval& columns) const {
    if (!is_sorted_) return {0, size()};
    const std::size_t begin = first_slots_[column_of(columns.narrow_first())];
    return {begin - begin % detail::block_size, first_slots_[column_of(columns.narrow_last()) + 1]};
  }

  std::ptrdiff_t signed_size() const { return static_cast<std::ptrdiff_t>(size()); }

  void round_block(std::size_t block) {
    const std::size_t first = block * detail::block_size;
    if (!detail::are_ordinary(&positions_[2 * first])) return round_extraordinary_block(first);
    int rounded[2 * detail::block_size];
    for (std::size_t j = 0; j < 2 * detail::block_size; ++j) {
      rounded[j] = detail::round_half_up(positions_[2 * first + j]);
    }
    std::int16_t x[detail::block_size], y[detail::block_size];
    for (std::size_t j = 0; j < detail::block_size; ++j) {
      x[j] = static_cast<std::int16_t>(rounded[2 * j]);
      y[j] = static_cast<std::int16_t>(rounded[2 * j + 1]);
    }
    std::memcpy(&pixels_[first], rounded, sizeof rounded);
    std::memcpy(&narrow_x_[first], x, sizeof x);
    std::memcpy(&narrow_y_[first], y, sizeof y);
  }

  /// With positions that are no numbers, or lie far from any image.
  void round_extraordinary_block(std::size_t first) {
    for (std::size_t i = first; i < first + detail::block_size; ++i) {
      pixels_[i] = nearest_pixel({positions_[2 * i], positions_[2 * i + 1]});
      narrow_x_[i] = detail::narrowed(pixels_[i].x);
      narrow_y_[i] = detail::narrowed(pixels_[i].y);
    }
  }

  FeaturesView view_;
  std::vector<float> positions_;  // x and y in turn
  std::vector<cv::Point> pixels_;
  // The same, cut off at the ends of 16 bits: half the bytes to compare.
  std::vector<std::int16_t> narrow_x_, narrow_y_;
  std::vector<std::uint32_t> order_;               // the feature that a bit of a block stands for
  std::vector<std::int16_t> sorted_x_, sorted_y_;  // memory to sort into
  bool is_sorted_ = false;
  int column_shift_ = 0;                                       // a column is 2^shift pixels wide
  std::array<std::uint32_t, most_columns + 1> first_slots_{};  // of each column, and the end
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURE_PIXELS_HPP
