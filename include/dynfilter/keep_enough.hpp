// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_KEEP_ENOUGH_HPP
#define DYNFILTER_KEEP_ENOUGH_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace dynfilter {

/// Removal that is planned, of a feature that is more or less surely dynamic.
struct PlannedRemoval {
  std::size_t feature = 0;  ///< index of the feature
  double doubt = 0;         ///< 0: sure; else any measure, which may be infinite
};

/// Returns how many planned removals must be given up, if they leave `kept` of the features: hosts
/// lose the camera by too few features sooner than by some moving ones. Enough are the smallest
/// share, and 300, or half of all if that is less. If they are not kept, half of all should be, or
/// the share if that is more. A share of 0 asks for none.
inline std::size_t missing_features(std::size_t features, std::size_t kept, double min_kept_share) {
  constexpr double min_kept = 300;  // A larger number keeps more features that move.
  const double all = static_cast<double>(features), half = all / 2;
  const double enough = std::max(min_kept_share * all, std::min(min_kept, half));
  if (min_kept_share == 0 || static_cast<double>(kept) >= enough) return 0;
  return static_cast<std::size_t>(std::ceil(std::max(enough, half))) - kept;
}

/// Gives up the `count` (1 or more) most doubtful removals and all that are as doubtful as the last
/// of them, but no sure ones. Changes the order. O(removals).
inline void keep_most_doubtful(std::vector<PlannedRemoval>& removals, std::size_t count) {
  double least = std::numeric_limits<double>::min();  // any doubt
  if (removals.size() > count) {
    const auto last = removals.end() - static_cast<std::ptrdiff_t>(count);
    std::nth_element(removals.begin(), last, removals.end(),
                     [](const auto& a, const auto& b) { return a.doubt < b.doubt; });
    least = std::max(least, last->doubt);
  }
  const auto is_kept = [&](const PlannedRemoval& removal) { return removal.doubt >= least; };
  removals.erase(std::remove_if(removals.begin(), removals.end(), is_kept), removals.end());
}

}  // namespace dynfilter

#endif  // DYNFILTER_KEEP_ENOUGH_HPP
