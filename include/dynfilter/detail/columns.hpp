// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What keep_static does with one column: a std::vector, or the rows of a cv::Mat.

#ifndef DYNFILTER_DETAIL_COLUMNS_HPP
#define DYNFILTER_DETAIL_COLUMNS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <type_traits>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

[[noreturn]] inline void throw_length(std::size_t position, std::size_t got, std::size_t want) {
  throw_misuse("keep_static", concatenate("column ", position, " of length ", got),
               concatenate("as many as there are labels, ", want));
}

template <class T, class Allocator>
void require_length(const std::vector<T, Allocator>& column, std::size_t length,
                    std::size_t position) {
  static_assert(std::is_nothrow_move_assignable<T>::value,
                "keep_static must not fail halfway: elements need a noexcept move assignment");
  if (column.size() != length) throw_length(position, column.size(), length);
}

inline void require_length(const cv::Mat& column, std::size_t length, std::size_t position) {
  if (column.dims > 2) {
    throw_misuse("keep_static",
                 concatenate("column ", position, " with ", column.dims, " dimensions"),
                 "a matrix with a row a feature");
  }
  const auto rows = static_cast<std::size_t>(column.rows);
  if (rows != length) throw_length(position, rows, length);
}

/// Throws where a column stands in the list twice: the second time its rows would be others.
inline void require_distinct(std::initializer_list<const void*> columns) {
  for (auto column = columns.begin(); column != columns.end(); ++column) {
    const auto first = std::find(columns.begin(), column, *column);
    if (first == column) continue;
    throw_misuse("keep_static",
                 concatenate("column ", column - columns.begin(), " that is column ",
                             first - columns.begin(), " again"),
                 "every column once");
  }
}

template <class T, class Allocator>
void unshare(std::vector<T, Allocator>&) {}

inline void unshare(cv::Mat& column) {
  const bool owned_alone = column.u != nullptr && column.u->refcount == 1;
  if (!owned_alone) column = column.clone();
}

/// Moves elements of a column; of bits, too, which have no addresses.
template <class T, class Allocator>
struct Elements {
  std::vector<T, Allocator>& column;

  void move(std::size_t from, std::size_t to) const {
    if (from != to) column[to] = std::move(column[from]);
  }
};

template <class T, class Allocator>
Elements<T, Allocator> elements_of(std::vector<T, Allocator>& column) {
  return {column};
}

/// Copies rows of a column.
struct Rows {
  std::uint8_t* first;
  std::size_t step, row_bytes;

  void move(std::size_t from, std::size_t to) const {
    constexpr std::size_t orb = 32;  // known lengths are copied in one step
    if (row_bytes == orb) {
      std::uint8_t row[orb];
      std::memcpy(row, first + from * step, orb);
      std::memcpy(first + to * step, row, orb);
    } else if (row_bytes > 0) {
      std::memmove(first + to * step, first + from * step, row_bytes);
    }
  }
};

inline Rows elements_of(cv::Mat& column) {
  return {column.data, column.step[0], static_cast<std::size_t>(column.cols) * column.elemSize()};
}

template <class T, class Allocator>
void shorten(std::vector<T, Allocator>& column, std::size_t kept) {
  column.erase(std::next(column.begin(), static_cast<std::ptrdiff_t>(kept)), column.end());
}

inline void shorten(cv::Mat& column, std::size_t kept) {
  const int rows = static_cast<int>(kept);
  // An empty range of rows would lose the number of columns.
  if (rows == 0) column = cv::Mat(0, column.cols, column.type());
  if (rows < column.rows) column = column.rowRange(0, rows);
}

/// Moves what is kept to the front, in each of the columns. Returns how many are kept.
template <class... AnyElements>
std::size_t move_kept(const FeatureLabels& labels, const AnyElements... elements) {
  std::size_t kept = 0;
  for (std::size_t block = 0; block < labels.removed_bits().size(); ++block) {
    const std::size_t first = block * block_size;
    const std::uint64_t kept_bits =
        ~labels.removed_bits()[block] & bits_below(labels.size() - first);
    const bool all_stay = kept == first && labels.removed_bits()[block] == 0;
    if (all_stay) {
      kept += count_bits(kept_bits);
      continue;
    }
    for_each_bit(kept_bits, [&](std::size_t bit) {
      (elements.move(first + bit, kept), ...);
      ++kept;
    });
  }
  return kept;
}

/// Takes the removed features out of all columns. Returns how many are kept.
template <class... Columns>
std::size_t compact(const FeatureLabels& labels, Columns&... columns) {
  const std::size_t kept = move_kept(labels, elements_of(columns)...);
  (shorten(columns, kept), ...);
  return kept;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_COLUMNS_HPP
