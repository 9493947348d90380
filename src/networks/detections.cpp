// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "detections.hpp"

#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {

float FiniteScores::probability(float score) {
  if (!std::isfinite(score)) return std::numeric_limits<float>::quiet_NaN();
  constexpr float tolerance = 1e-3F;
  if (score < -tolerance || score > 1 + tolerance) {
    throw std::runtime_error(
        concatenate("its outputs hold the score ", score, "; want probabilities from 0 to 1"));
  }
  has_any_ = true;
  return std::clamp(score, 0.0F, 1.0F);
}

void FiniteScores::require_some(int rows) const {
  if (rows == 0 || has_any_) return;
  throw std::runtime_error(
      "none of its scores is a finite number (NaN or infinity); its weights may be damaged");
}

float intersection_over_union(const Box& a, const Box& b) {
  const auto area = [](const Box& box) { return (box.x2 - box.x1) * (box.y2 - box.y1); };
  const float width = std::min(a.x2, b.x2) - std::max(a.x1, b.x1);
  const float height = std::min(a.y2, b.y2) - std::max(a.y1, b.y1);
  const float common = std::max(width, 0.0F) * std::max(height, 0.0F);
  const float joint = area(a) + area(b) - common;
  return joint > 0 ? common / joint : 0.0F;
}

std::vector<Detection> best_detections(std::vector<Detection> found,
                                       const DetectionOptions& options, bool suppresses) {
  std::stable_sort(found.begin(), found.end(), [](const Detection& a, const Detection& b) {
    return std::make_pair(-a.score, a.class_id) < std::make_pair(-b.score, b.class_id);
  });
  std::vector<Detection> kept;
  for (Detection& one : found) {
    if (kept.size() == static_cast<std::size_t>(options.max_detections)) break;
    const auto overlaps = [&](const Detection& better) {
      return better.class_id == one.class_id &&
             intersection_over_union(better.box, one.box) > options.iou_threshold;
    };
    if (suppresses && std::any_of(kept.begin(), kept.end(), overlaps)) continue;
    kept.push_back(std::move(one));
  }
  return kept;
}

}  // namespace dynfilter::detail
