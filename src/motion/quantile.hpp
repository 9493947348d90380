// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Quantiles of measured values.

#ifndef DYNFILTER_SRC_MOTION_QUANTILE_HPP
#define DYNFILTER_SRC_MOTION_QUANTILE_HPP

#include <algorithm>
#include <cstddef>
#include <vector>

namespace dynfilter::detail {

/// Returns the value that a share of the values is below, their median by default. The share is
/// below 1, and there are values. Changes their order. O(n).
template <class Value>
Value quantile_of(std::vector<Value>& values, double share = 0.5) {
  const double below = share * static_cast<double>(values.size());
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_QUANTILE_HPP
