// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>

#include <opencv2/core.hpp>

#include "dynfilter/detail/columns.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter {

/// Returns how many features below index `pivot` are kept. Hosts whose arrays have two blocks need
/// it (ORB-SLAM3's monoLeft, monoRight, Nleft). Throws std::invalid_argument for a pivot above the
/// number of features.
inline std::size_t kept_below(const FeatureLabels& labels, std::size_t pivot) {
  if (pivot > labels.size()) {
    detail::throw_misuse("kept_below", detail::concatenate("pivot ", pivot),
                         detail::concatenate("at most the number of features, ", labels.size()));
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < pivot; ++i) kept += labels.is_removed(i) ? 0 : 1;
  return kept;
}

/// Removes the removed features from the caller's parallel arrays, in place and in order. A column
/// is a std::vector with one element per feature (keypoints, points, ids, track counts, …) or a
/// cv::Mat with one row per feature (descriptors). Returns the number of features kept.
///
/// All lengths are checked first: either every column shrinks or none. A matrix that shares its
/// data with another header, or does not own it, is compacted into a copy, so that the rows of the
/// other header stay in place. Elements of vectors must be nothrow move-assignable. Throws
/// std::invalid_argument for a column of another length and for one that is given twice. O(features
/// x columns); allocates only for shared matrices.
template <class... Columns>
std::size_t keep_static(const FeatureLabels& labels, Columns&... columns) {
  detail::require_distinct({static_cast<const void*>(&columns)...});
  std::size_t position = 0;
  (detail::require_length(columns, labels.size(), position++), ...);
  (detail::unshare(columns), ...);  // the last step that may throw; no row has moved yet
  std::size_t first_removed = 0;
  while (first_removed < labels.size() && !labels.is_removed(first_removed)) ++first_removed;
  (detail::move_kept(labels, first_removed, columns), ...);
  const std::size_t kept = kept_below(labels, labels.size());
  (detail::shorten(columns, kept), ...);
  return kept;
}

}  // namespace dynfilter
