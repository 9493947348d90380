// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Non-maximum suppression: keeps one of the many boxes on an object.

#ifndef DYNFILTER_SRC_NETWORKS_NON_MAXIMUM_SUPPRESSION_HPP
#define DYNFILTER_SRC_NETWORKS_NON_MAXIMUM_SUPPRESSION_HPP

#include <vector>

#include "detections.hpp"

namespace dynfilter::detail {

/// A box to be suppressed or kept; `row` is the detection's row in the output.
struct Candidate {
  int class_id = 0;
  float score = 0;
  int row = 0;
  Box box;
};

/// Returns the boxes' common area divided by their joint area; 0 if neither has an area.
float intersection_over_union(const Box& a, const Box& b);

/// Sorts by score, the highest first; equal scores by class, then by row.
void sort_by_score(std::vector<Candidate>& candidates);

/// Suppresses greedily: goes from the highest score down and drops a candidate whose box overlaps a
/// kept one of its class by more than `iou_threshold`. Sorted by score. O(n²).
std::vector<Candidate> suppress_greedily(std::vector<Candidate> candidates, float iou_threshold);

/// Suppresses by Fast NMS (D. Bolya, C. Zhou, F. Xiao, Y. J. Lee, "YOLACT: Real-time Instance
/// Segmentation", ICCV 2019, section 3.3). Considers the `max_per_class` highest scores of each
/// class, and drops a candidate whose box overlaps any box of higher score by more than
/// `iou_threshold`, even a dropped one. Sorted by score. O(classes · max_per_class²).
std::vector<Candidate> suppress_fast(std::vector<Candidate> candidates, float iou_threshold,
                                     int max_per_class);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_NON_MAXIMUM_SUPPRESSION_HPP
