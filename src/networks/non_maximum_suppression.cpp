// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "non_maximum_suppression.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <tuple>
#include <utility>

namespace dynfilter::detail {
namespace {

float area(const Box& box) { return (box.x2 - box.x1) * (box.y2 - box.y1); }

}  // namespace

float intersection_over_union(const Box& a, const Box& b) {
  const float width = std::min(a.x2, b.x2) - std::max(a.x1, b.x1);
  const float height = std::min(a.y2, b.y2) - std::max(a.y1, b.y1);
  const float common = std::max(width, 0.0F) * std::max(height, 0.0F);
  const float joint = area(a) + area(b) - common;
  return joint > 0 ? common / joint : 0.0F;
}

void sort_by_score(std::vector<Candidate>& candidates) {
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::make_tuple(-a.score, a.class_id, a.row) <
           std::make_tuple(-b.score, b.class_id, b.row);
  });
}

std::vector<Candidate> suppress_greedily(std::vector<Candidate> candidates, float iou_threshold) {
  sort_by_score(candidates);
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates) {
    const bool is_suppressed = std::any_of(kept.begin(), kept.end(), [&](const Candidate& better) {
      return better.class_id == candidate.class_id &&
             intersection_over_union(better.box, candidate.box) > iou_threshold;
    });
    if (!is_suppressed) kept.push_back(candidate);
  }
  return kept;
}

std::vector<Candidate> suppress_fast(std::vector<Candidate> candidates, float iou_threshold,
                                     int max_per_class) {
  sort_by_score(candidates);
  std::map<int, std::vector<Candidate>> classes;
  for (const Candidate& candidate : candidates) {
    std::vector<Candidate>& best = classes[candidate.class_id];
    if (best.size() < static_cast<std::size_t>(max_per_class)) best.push_back(candidate);
  }
  std::vector<Candidate> kept;
  for (const auto& [class_id, best] : classes) {
    for (std::size_t j = 0; j < best.size(); ++j) {
      float largest = 0;
      for (std::size_t i = 0; i < j; ++i) {
        largest = std::max(largest, intersection_over_union(best[i].box, best[j].box));
      }
      if (largest <= iou_threshold) kept.push_back(best[j]);
    }
  }
  sort_by_score(kept);
  return kept;
}

}  // namespace dynfilter::detail
