// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_PIXELS_HPP
#define DYNFILTER_FEATURE_PIXELS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/block_rounding.hpp"
#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/detail/narrow_pixels.hpp"
#include "dynfilter/feature_list.hpp"
#include "dynfilter/features.hpp"

namespace dynfilter {

/// The pixels of a frame's features, rounded once and laid out so that 64 of them are compared with
/// a rectangle at once: stages ask for each instance which features are in its box.
class FeaturePixels {
 public:
  /// Of the processor's instructions, the best up to those of a set are used.
  explicit FeaturePixels(detail::InstructionSet best = detail::best_instruction_set())
      : instruction_set_(best) {}

  /// Reads the features' pixels, reusing memory. Where many rectangles will be asked for, features
  /// are sorted by their column, so that most of them need not be looked at. O(features).
  void read(FeaturesView features, std::size_t expected_rectangles = 0) {
    view_ = features;
    reserve();
    round_all();
    // Sorting costs about as much as comparing all features with some ten rectangles.
    is_sorted_ = expected_rectangles >= 8;
    if (is_sorted_) sort_by_column();
  }

  std::size_t size() const { return view_.size(); }

  /// Whether these are the pixels of that view, as far as its place in memory tells.
  bool are_of(const FeaturesView& features) const { return view_.is_same_view(features); }

  /// As FeaturesView::pixel gives it. i must be below size().
  cv::Point operator[](std::size_t i) const { return pixels_[i]; }

  /// All of them. A loop that writes elsewhere had better ask once: compilers must take it that
  /// what is written may be where this lies.
  const cv::Point* data() const { return pixels_.data(); }

  /// Where all of them lie; empty where that is not known, because some are very far away, and
  /// where there are none.
  const cv::Rect& bounds() const { return bounds_; }

  /// The features whose pixels lie in the rectangle, wherever that lies, in an order of their own,
  /// but for those whose bit in `without` is set: bit i % 64 of word i / 64, as
  /// FeatureLabels::removed_bits has them. The list lies in `memory`. Throws std::invalid_argument
  /// for fewer words. O(features / 64), and the features that lie in it.
  FeatureList inside(const cv::Rect& rectangle, const std::vector<std::uint64_t>& without,
                     std::vector<std::uint32_t>& memory) const {
    return inside(detail::Interval(rectangle.x, rectangle.width),
                  detail::Interval(rectangle.y, rectangle.height), without, memory);
  }

  FeatureList inside(const detail::Interval& columns, const detail::Interval& rows,
                     const std::vector<std::uint64_t>& without,
                     std::vector<std::uint32_t>& memory) const {
    require_bits(without);
    FeatureList list(memory, size(), instruction_set_);
    if (columns.empty() || rows.empty()) return list;
    if (!columns.is_narrow() || !rows.is_narrow()) {
      list_wide(columns, rows, without, list);
    } else if (is_sorted_) {
      list_sorted(columns, rows, without, list);
    } else {
      const detail::PixelBlocks all = {narrow_.data(), blocks(), 0, without.data()};
      list.end_ = detail::list_inside(all, {columns, rows}, instruction_set_, list.end_);
    }
    return list;
  }

  /// All features but those whose bit is set, see inside. O(features).
  FeatureList all_but(const std::vector<std::uint64_t>& without,
                      std::vector<std::uint32_t>& memory) const {
    require_bits(without);
    FeatureList list(memory, size(), instruction_set_);
    for (std::size_t block = 0; block < blocks(); ++block) {
      const std::size_t first = block * detail::block_size;
      detail::for_each_bit(~without[block] & detail::bits_below(size() - first),
                           [&](std::size_t bit) { list.add_if(true, first + bit); });
    }
    return list;
  }

 private:
  static constexpr std::size_t most_columns = 64;

  std::size_t blocks() const { return detail::blocks_for(size()); }

  void require_bits(const std::vector<std::uint64_t>& bits) const {
    if (bits.size() >= blocks()) return;
    detail::throw_misuse("FeaturePixels", detail::concatenate(bits.size(), " words of bits"),
                         detail::concatenate("one for each 64 features, ", blocks()));
  }

  void reserve() {
    if (narrow_.size() >= blocks()) return;
    sorted_.resize(blocks());
    pixels_.resize(blocks() * detail::block_size);
    order_.resize(blocks() * detail::block_size);
    narrow_.resize(blocks());  // last: its size promises that of the others
  }

  static detail::NarrowPixel& pixel(std::vector<detail::NarrowBlock>& blocks, std::size_t i) {
    return blocks[i / detail::block_size].pixels[i % detail::block_size];
  }

  void round_all() {
    const detail::Positions positions(view_);
    detail::NarrowBounds bounds;
    for (std::size_t block = 0; block < blocks(); ++block) {
      const std::size_t first = block * detail::block_size;
      detail::round_block(positions.from(first), size() - first, instruction_set_, &pixels_[first],
                          narrow_[block], bounds);
    }
    bounds_ = bounds.rectangle();
    pad(narrow_);
  }

  /// With pixels that lie in no narrow interval, to the end of the last block.
  void pad(std::vector<detail::NarrowBlock>& pixels) const {
    const detail::NarrowPixel outside = {detail::least_narrow, detail::least_narrow};
    const std::size_t in_last = size() % detail::block_size;
    if (in_last == 0) return;
    detail::NarrowBlock& last = pixels[blocks() - 1];
    std::fill(last.pixels + in_last, std::end(last.pixels), outside);
  }

  /// By counting: features of equal columns keep their order.
  void sort_by_column() {
    const auto column = [&](std::size_t i) { return column_of(pixel(narrow_, i).x); };
    int highest = 0;
    for (std::size_t i = 0; i < size(); ++i) highest = std::max<int>(highest, pixel(narrow_, i).x);
    column_shift_ = 0;
    while (static_cast<unsigned>(highest) >> column_shift_ >= most_columns) ++column_shift_;
    first_slots_.fill(0);
    for (std::size_t i = 0; i < size(); ++i) ++first_slots_[column(i) + 1];
    for (std::size_t c = 0; c < most_columns; ++c) first_slots_[c + 1] += first_slots_[c];
    std::array<std::uint32_t, most_columns + 1> next = first_slots_;
    for (std::size_t i = 0; i < size(); ++i) {
      const std::size_t slot = next[column(i)]++;
      pixel(sorted_, slot) = pixel(narrow_, i);
      order_[slot] = static_cast<std::uint32_t>(i);
    }
    pad(sorted_);
  }

  /// What lies left of the image is in its first column, what lies right of all features in the
  /// last.
  std::size_t column_of(int x) const {
    const std::size_t column = static_cast<unsigned>(std::max(x, 0)) >> column_shift_;
    return std::min(column, most_columns - 1);
  }

  void list_sorted(const detail::Interval& columns, const detail::Interval& rows,
                   const std::vector<std::uint64_t>& without, FeatureList& list) const {
    const std::size_t begin = first_slots_[column_of(columns.narrow_first())] / detail::block_size;
    const std::size_t end = detail::blocks_for(first_slots_[column_of(columns.narrow_last()) + 1]);
    const detail::PixelBlocks slots = {sorted_.data() + begin, end - begin,
                                       begin * detail::block_size, nullptr};
    list.end_ = detail::list_inside(slots, {columns, rows}, instruction_set_, list.end_);
    for (std::uint32_t* slot = list.begin_; slot != list.end_; ++slot) *slot = order_[*slot];
    list.leave_only([&](std::size_t i) { return !has_bit(without, i); });
  }

  /// Rectangles that reach to the ends of 16 bits, or beyond.
  void list_wide(const detail::Interval& columns, const detail::Interval& rows,
                 const std::vector<std::uint64_t>& without, FeatureList& list) const {
    for (std::size_t i = 0; i < size(); ++i) {
      const bool is_inside = columns.contains(pixels_[i].x) && rows.contains(pixels_[i].y);
      list.add_if(is_inside && !has_bit(without, i), i);
    }
  }

  static bool has_bit(const std::vector<std::uint64_t>& bits, std::size_t i) {
    return (bits[i / detail::block_size] >> i % detail::block_size & 1U) != 0;
  }

  detail::InstructionSet instruction_set_;
  FeaturesView view_;
  std::vector<cv::Point> pixels_;
  std::vector<detail::NarrowBlock> narrow_;  // the same in half the bytes
  cv::Rect bounds_;
  bool is_sorted_ = false;
  std::vector<detail::NarrowBlock> sorted_;
  std::vector<std::uint32_t> order_;                           // the feature of a sorted pixel
  int column_shift_ = 0;                                       // a column is 2^shift pixels wide
  std::array<std::uint32_t, most_columns + 1> first_slots_{};  // of each column, and the end
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURE_PIXELS_HPP
