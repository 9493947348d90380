// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Comparison of a filter's labels with the truth, in features. A feature is dynamic on the exact
/// silhouette of an object, and static more than `rim_px` outside every silhouette. Between them is
/// the rim, where an occlusion contour is not a landmark and either verdict is right.
struct FeatureScores {
  std::size_t dynamic_left = 0;     ///< dynamic features that are kept
  std::size_t dynamic_removed = 0;  ///< dynamic features that are removed
  std::size_t static_left = 0;      ///< static features that are kept
  std::size_t static_removed = 0;   ///< static features that are removed
  std::size_t rim_left = 0;         ///< features on the rim that are kept
  std::size_t rim_removed = 0;      ///< features on the rim that are removed

  /// Adds the counts of another frame.
  FeatureScores& operator+=(const FeatureScores& other) {
    dynamic_left += other.dynamic_left;
    dynamic_removed += other.dynamic_removed;
    static_left += other.static_left;
    static_removed += other.static_removed;
    rim_left += other.rim_left;
    rim_removed += other.rim_removed;
    return *this;
  }
};

/// Scores the labels of one frame. All instances of `truth` count as dynamic. Distances are
/// Euclidean, between pixel centres. Throws std::invalid_argument for a malformed truth and if
/// labels and features differ in number.
/// O(features x instances x rim_px^2).
inline FeatureScores score_features(FeaturesView features, const FeatureLabels& labels,
                                    const Segmentation& truth, double rim_px = 3.0) {
  validate(truth, "score_features");
  if (labels.size() != features.size()) {
    detail::throw_misuse(
        "score_features",
        detail::concatenate(labels.size(), " labels and ", features.size(), " features"),
        "one label per feature");
  }
  FeatureScores scores;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const cv::Point pixel = features.pixel(i);
    const bool removed = labels.is_removed(i);
    const auto lies_within = [&](double distance) {
      return std::any_of(truth.instances.begin(), truth.instances.end(), [&](const auto& instance) {
        return detail::mask_within(instance, pixel, distance);
      });
    };
    if (lies_within(0)) {
      ++(removed ? scores.dynamic_removed : scores.dynamic_left);
    } else if (lies_within(rim_px)) {
      ++(removed ? scores.rim_removed : scores.rim_left);
    } else {
      ++(removed ? scores.static_removed : scores.static_left);
    }
  }
  return scores;
}

}  // namespace dynfilter
