// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Associates instances found now with known ones.

#ifndef DYNFILTER_SRC_SEGMENTERS_PROPAGATION_BOX_ASSOCIATION_HPP
#define DYNFILTER_SRC_SEGMENTERS_PROPAGATION_BOX_ASSOCIATION_HPP

#include <algorithm>
#include <cstddef>
#include <optional>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Returns the intersection over union; 0 if both are empty.
inline double box_overlap(const cv::Rect2d& a, const cv::Rect2d& b) {
  const double both = (a & b).area();
  const double either = a.area() + b.area() - both;
  return both > 0 ? both / either : 0;
}

struct LabelledBox {
  cv::Rect2d box;
  int class_id = 0;
  bool is_free = true;  // may be matched by its box
};

/// Returns, for each found box, the index of the known box of its class that it is associated with.
/// Pairs with the largest overlap come first; overlaps below `min_overlap` do not count. Of equal
/// overlaps, the lower index wins, the found one's first. O(n log n) of the pairs that overlap.
inline std::vector<std::optional<std::size_t>> associate(const std::vector<LabelledBox>& found,
                                                         const std::vector<LabelledBox>& known,
                                                         double min_overlap) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;  // by -overlap
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (!found[i].is_free || !known[k].is_free || found[i].class_id != known[k].class_id)
        continue;
      const double overlap = box_overlap(found[i].box, known[k].box);
      if (overlap > 0 && overlap >= min_overlap) pairs.emplace_back(-overlap, i, k);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<std::optional<std::size_t>> match(found.size());
  std::vector<bool> is_taken(known.size(), false);
  for (const auto& [negative, i, k] : pairs) {
    if (match[i] || is_taken[k]) continue;
    match[i] = k;
    is_taken[k] = true;
  }
  return match;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_PROPAGATION_BOX_ASSOCIATION_HPP
