// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Quantiles of measured values.

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace dynfilter::detail {

/// Returns the value that a share of the values, 0 to 1, is below, their median by default; the
/// largest one for 1. There are values. Changes their order. O(n).
template <class Value>
Value quantile_of(std::vector<Value>& values, double share = 0.5) {
  const auto below = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(std::min(below, values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// Returns the median of sorted values; the mean of the middle two if their number is even.
inline double median_of_sorted(const std::vector<double>& sorted) {
  const std::size_t middle = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}

/// Returns the median of values as median_of_sorted. O(n log n).
inline double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return median_of_sorted(values);
}

}  // namespace dynfilter::detail
