// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "networks/detections.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {

/// Expects the same objects in the same order, with equal numbers up to rounding errors.
inline void expect_same(const std::vector<detail::Detection>& got,
                        const std::vector<detail::Detection>& want) {
  ASSERT_EQ(got.size(), want.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(got[i].class_id, want[i].class_id);
    EXPECT_NEAR(got[i].score, want[i].score, 1e-6F);
    EXPECT_NEAR(got[i].box.x1, want[i].box.x1, 1e-3F);
    EXPECT_NEAR(got[i].box.y1, want[i].box.y1, 1e-3F);
    EXPECT_NEAR(got[i].box.x2, want[i].box.x2, 1e-3F);
    EXPECT_NEAR(got[i].box.y2, want[i].box.y2, 1e-3F);
    EXPECT_EQ(got[i].coefficients, want[i].coefficients);
  }
}

inline detail::DetectionOptions options_of(float score, float iou, int max_detections) {
  detail::DetectionOptions options;
  options.score_threshold = score;
  options.iou_threshold = iou;
  options.max_detections = max_detections;
  return options;
}

/// Oracle: overlap of two boxes, in double precision.
inline double overlap(const detail::Box& a, const detail::Box& b) {
  const auto length = [](double first, double last) { return last > first ? last - first : 0.0; };
  const double common = length(std::max(a.x1, b.x1), std::min(a.x2, b.x2)) *
                        length(std::max(a.y1, b.y1), std::min(a.y2, b.y2));
  const double joint =
      length(a.x1, a.x2) * length(a.y1, a.y2) + length(b.x1, b.x2) * length(b.y1, b.y2) - common;
  return joint > 0 ? common / joint : 0;
}

/// Oracle of suppression: repeatedly picks the best remaining row.
inline std::vector<detail::Detection> picked(std::vector<detail::Detection> rows,
                                             const detail::DetectionOptions& options) {
  std::vector<detail::Detection> result;
  while (result.size() < std::size_t(options.max_detections)) {
    const detail::Detection* best = nullptr;
    for (const detail::Detection& row : rows) {
      if (row.score > options.score_threshold && options.wants(row.class_id) &&
          (best == nullptr || row.score > best->score)) {
        best = &row;
      }
    }
    if (best == nullptr) break;
    result.push_back(*best);
    for (detail::Detection& row : rows) {
      if (row.class_id == result.back().class_id &&
          overlap(row.box, result.back().box) > double{options.iou_threshold}) {
        row.score = -1;
      }
    }
    for (detail::Detection& row : rows) {
      if (row.box.x1 == result.back().box.x1 && row.score == result.back().score) row.score = -1;
    }
  }
  return result;
}

}  // namespace dynfilter::testing
