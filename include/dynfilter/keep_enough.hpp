// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace dynfilter {

/// Planned removal of a feature.
struct PlannedRemoval {
  std::size_t feature = 0;  ///< index of the feature
  double doubt = 0;         ///< 0: sure; else any measure, which may be infinite
};

/// Takes the most doubtful removals, and all that are equally doubtful, off a plan that keeps
/// `kept` of the features, if these are too few for hosts not to lose the camera: fewer than the
/// share, or than 300 (or half of all, if that is less). Then half of all should be kept, or the
/// share if that is more, but sure removals stay planned. A share of 0 asks for none. Asks
/// `doubt_of(feature)` if they are too few, and returns whether they are. Changes the order.
/// O(removals).
template <class DoubtOf>
bool keep_enough(std::vector<PlannedRemoval>& removals, std::size_t features, std::size_t kept,
                 double min_kept_share, const DoubtOf& doubt_of) {
  constexpr double min_kept = 300;  // A larger number keeps more features that move.
  const double all = static_cast<double>(features), half = all / 2;
  const double enough = std::max(min_kept_share * all, std::min(min_kept, half));
  if (min_kept_share == 0 || static_cast<double>(kept) >= enough) return false;
  const std::size_t missing = static_cast<std::size_t>(std::ceil(std::max(enough, half))) - kept;
  for (PlannedRemoval& removal : removals) removal.doubt = doubt_of(removal.feature);
  double least = std::numeric_limits<double>::min();  // any doubt
  if (removals.size() > missing) {
    const auto last = removals.end() - static_cast<std::ptrdiff_t>(missing);
    std::nth_element(removals.begin(), last, removals.end(),
                     [](const auto& a, const auto& b) { return a.doubt < b.doubt; });
    least = std::max(least, last->doubt);
  }
  const auto is_kept = [&](const PlannedRemoval& removal) { return removal.doubt >= least; };
  removals.erase(std::remove_if(removals.begin(), removals.end(), is_kept), removals.end());
  return true;
}

}  // namespace dynfilter
