// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Steps of keep_static for one column, a std::vector or a cv::Mat: checks, moves, shortening.

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

[[noreturn]] inline void throw_length(std::size_t position, std::size_t got, std::size_t want) {
  throw_misuse("keep_static", concatenate("column ", position, " of length ", got),
               concatenate("the number of labels, ", want));
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
                 "a matrix with one row per feature");
  }
  const auto rows = static_cast<std::size_t>(column.rows);
  if (rows != length) throw_length(position, rows, length);
}

/// Throws if a column is listed twice: its rows would be moved twice.
inline void require_distinct(std::initializer_list<const void*> columns) {
  for (auto column = columns.begin(); column != columns.end(); ++column) {
    const auto first = std::find(columns.begin(), column, *column);
    if (first == column) continue;
    throw_misuse("keep_static",
                 concatenate("column ", column - columns.begin(), " that is column ",
                             first - columns.begin(), " again"),
                 "each column once");
  }
}

template <class T, class Allocator>
void unshare(std::vector<T, Allocator>&) {}

inline void unshare(cv::Mat& column) {
  const bool owned_alone = column.u != nullptr && column.u->refcount == 1;
  // Without columns there is nothing to share, and a clone would lose the number of rows.
  if (!owned_alone && !column.empty()) column = column.clone();
}

/// Moves the kept elements of a column to the front. The elements before `first`, the index of the
/// first removed feature, stay where they are.
template <class T, class Allocator>
void move_kept(const FeatureLabels& labels, std::size_t first, std::vector<T, Allocator>& column) {
  std::size_t kept = first;
  for (std::size_t i = first + 1; i < labels.size(); ++i) {
    column[kept] = std::move(column[i]);  // the next one overwrites what is removed
    kept += labels.is_removed(i) ? 0 : 1;
  }
}

/// Moves the kept rows likewise. Nobody else may see the matrix.
inline void move_kept(const FeatureLabels& labels, std::size_t first, cv::Mat& column) {
  if (first >= labels.size()) return;  // an empty matrix has no size of elements
  const std::size_t row_bytes = static_cast<std::size_t>(column.cols) * column.elemSize();
  if (row_bytes == 0) return;
  const std::size_t step = column.step[0];
  std::uint8_t* to = column.data + first * step;
  const std::uint8_t* from = to;
  for (std::size_t i = first + 1; i < labels.size(); ++i) {
    from += step;
    std::memcpy(to, from, row_bytes);
    to += labels.is_removed(i) ? 0 : step;
  }
}

template <class T, class Allocator>
void shorten(std::vector<T, Allocator>& column, std::size_t kept) {
  column.erase(std::next(column.begin(), static_cast<std::ptrdiff_t>(kept)), column.end());
}

inline void shorten(cv::Mat& column, std::size_t kept) {
  const int rows = static_cast<int>(kept);
  // An empty row range would lose the numbers of rows and columns.
  if (rows == 0 || column.cols == 0) column = cv::Mat(rows, column.cols, column.type());
  if (rows < column.rows) column = column.rowRange(0, rows);
}

}  // namespace dynfilter::detail
