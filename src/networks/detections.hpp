// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Detections: what decoders read from a network's outputs, before masks are assembled.

#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace dynfilter::detail {

/// A rectangle by its corners. Points on its right and lower sides belong to it only for its area.
struct Box {
  float x1 = 0, y1 = 0, x2 = 0, y2 = 0;

  /// Tells whether the area is positive and finite; false if a corner is NaN.
  bool has_area() const { return x2 > x1 && y2 > y1 && std::isfinite(x2 - x1 + y2 - y1); }
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
  std::vector<int> classes;   // empty = all
  float score_threshold = 0;  // a score must exceed it
  float iou_threshold = 0.5F;
  int max_detections = 100;

  bool wants(int class_id) const {
    return classes.empty() || std::find(classes.begin(), classes.end(), class_id) != classes.end();
  }
};

/// Watches the scores of one image: a network that overflowed, for example in half precision, must
/// not pass for one that saw no objects.
class FiniteScores {
 public:
  /// Returns the score as a probability without rounding errors; NaN if it is not finite. Throws
  /// std::runtime_error for a finite number that is no probability.
  float probability(float score);

  /// Throws std::runtime_error if there were rows but no finite score.
  void require_some(int rows) const;

 private:
  bool has_any_ = false;
};

/// Sorts by score, the highest first; equal scores by class, then as they came. Drops a detection
/// whose box overlaps a better one of its class by more than the threshold (not if `suppresses` is
/// false), and all beyond max_detections. O(n²).
std::vector<Detection> best_detections(std::vector<Detection> found,
                                       const DetectionOptions& options, bool suppresses = true);

}  // namespace dynfilter::detail
