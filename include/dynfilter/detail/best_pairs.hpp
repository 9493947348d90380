// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <tuple>
#include <vector>

namespace dynfilter::detail {

/// Pairs the objects of two lists, the most alike first, each once. Keeps its memory.
class BestPairs {
 public:
  /// Returns, for each object of the first list, its partner in the second, if it has one.
  /// `likeness(i, k)` says how much alike two are, 0: not at all. Of equally alike pairs, the lower
  /// i wins, then the lower k. O(first * second + p log p) for p pairs that are alike.
  template <class Likeness>
  const std::vector<std::optional<std::size_t>>& find(std::size_t first, std::size_t second,
                                                      const Likeness& likeness) {
    pairs_.clear();
    for (std::size_t i = 0; i < first; ++i) {
      for (std::size_t k = 0; k < second; ++k) {
        const double alike = likeness(i, k);
        if (alike > 0) pairs_.emplace_back(-alike, i, k);
      }
    }
    std::sort(pairs_.begin(), pairs_.end());
    partners_.assign(first, {});
    is_taken_.assign(second, false);
    for (const auto& [negative, i, k] : pairs_) {
      if (partners_[i] || is_taken_[k]) continue;
      partners_[i] = k;
      is_taken_[k] = true;
    }
    return partners_;
  }

 private:
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs_;
  std::vector<std::optional<std::size_t>> partners_;
  std::vector<bool> is_taken_;
};

}  // namespace dynfilter::detail
