// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Detections: what decoders read from a network's outputs, before masks are assembled.

#ifndef DYNFILTER_SRC_NETWORKS_DETECTIONS_HPP
#define DYNFILTER_SRC_NETWORKS_DETECTIONS_HPP

#include <cmath>
#include <functional>
#include <vector>

namespace dynfilter::detail {

/// A rectangle by its corners. Points on its right and lower sides belong to it only for its area.
struct Box {
  float x1 = 0, y1 = 0, x2 = 0, y2 = 0;

  /// Tells whether the area is positive; false if a corner is NaN.
  bool has_area() const { return x2 > x1 && y2 > y1; }

  bool is_finite() const {
    return std::isfinite(x1) && std::isfinite(y1) && std::isfinite(x2) && std::isfinite(y2);
  }
};

/// One object that a network found.
struct Detection {
  int class_id = 0;
  float score = 0;                  // 0 to 1
  Box box;                          // in pixels of the network's input
  std::vector<float> coefficients;  // of the prototypes of masks
};

/// Selects the detections that a decoder returns.
struct DetectionOptions {
  std::function<bool(int class_id)> is_wanted;
  float score_threshold = 0;  // a score must exceed it
  float iou_threshold = 0.5F;
  int max_detections = 100;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_DETECTIONS_HPP
