// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Which of many boxes on one object is left.

#ifndef DYNFILTER_SRC_NETWORKS_NON_MAXIMUM_SUPPRESSION_HPP
#define DYNFILTER_SRC_NETWORKS_NON_MAXIMUM_SUPPRESSION_HPP

#include <vector>

#include "detections.hpp"

namespace dynfilter::detail {

/// A box that stands for suppression: `row` says whose it is.
struct Candidate {
  int class_id = 0;
  float score = 0;
  int row = 0;
  Box box;
};

/// The common area of two boxes by their joint area; 0 where neither has an area.
float intersection_over_union(const Box& a, const Box& b);

/// By score, the highest first; equal scores in the order of class, then row.
void sort_by_score(std::vector<Candidate>& candidates);

/// The ordinary suppression: from the highest score down, a candidate is left out if its box
/// overlaps one of its class that was kept by more than `iou_threshold`. Sorted by score. O(n²).
std::vector<Candidate> suppress_greedily(std::vector<Candidate> candidates, float iou_threshold);

/// Fast NMS (D. Bolya, C. Zhou, F. Xiao, Y. J. Lee, "YOLACT: Real-time Instance Segmentation", ICCV
/// 2019, section 3.3): of every class the `max_per_class` with the highest scores are looked at,
/// and one is left out if its box overlaps any of higher score by more than `iou_threshold`, though
/// that may be left out itself. Sorted by score. O(classes · max_per_class²).
std::vector<Candidate> suppress_fast(std::vector<Candidate> candidates, float iou_threshold,
                                     int max_per_class);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_NON_MAXIMUM_SUPPRESSION_HPP
