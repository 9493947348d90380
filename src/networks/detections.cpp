// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "detections.hpp"

#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"

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

std::vector<Detection> best_detections(std::vector<Detection> found,
                                       const DetectionOptions& options, bool suppresses) {
  std::stable_sort(found.begin(), found.end(), [](const Detection& a, const Detection& b) {
    return std::make_pair(-a.score, a.class_id) < std::make_pair(-b.score, b.class_id);
  });
  const auto rectangle_of = [](const Box& box) {
    return cv::Rect2d(cv::Point2d(box.x1, box.y1), cv::Point2d(box.x2, box.y2));
  };
  std::vector<Detection> kept;
  for (Detection& one : found) {
    if (kept.size() == static_cast<std::size_t>(options.max_detections)) break;
    const auto overlaps = [&](const Detection& better) {
      return better.class_id == one.class_id &&
             intersection_over_union(rectangle_of(better.box), rectangle_of(one.box)) >
                 double{options.iou_threshold};
    };
    if (suppresses && std::any_of(kept.begin(), kept.end(), overlaps)) continue;
    kept.push_back(std::move(one));
  }
  return kept;
}

}  // namespace dynfilter::detail
