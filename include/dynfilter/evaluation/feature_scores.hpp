// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_FEATURE_SCORES_HPP
#define DYNFILTER_EVALUATION_FEATURE_SCORES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// How a filter's labels compare with the truth. A feature is dynamic on the exact silhouette of an
/// object, static more than `rim_px` outside every silhouette, and on the rim in between, where an
/// occlusion contour is no landmark and either verdict is right.
struct FeatureScores {
  std::size_t dynamic_left = 0;
  std::size_t dynamic_removed = 0;
  std::size_t static_left = 0;
  std::size_t static_removed = 0;
  std::size_t rim_left = 0;
  std::size_t rim_removed = 0;

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
/// Euclidean, between pixel centres. Throws std::invalid_argument for a malformed truth and for
/// another number of labels than features. O(features x instances x rim_px^2).
inline FeatureScores score_features(FeaturesView features, const FeatureLabels& labels,
                                    const Segmentation& truth, double rim_px = 3.0) {
  validate(truth, "score_features");
  if (labels.size() != features.size()) {
    detail::throw_misuse(
        "score_features",
        detail::concatenate(labels.size(), " labels and ", features.size(), " features"),
        "a label a feature");
  }
  const auto lies_within = [&](cv::Point pixel, double distance) {
    for (const Instance& instance : truth.instances) {
      if (detail::mask_within(instance, pixel, distance)) return true;
    }
    return false;
  };
  FeatureScores scores;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const cv::Point pixel = features.pixel(i);
    const bool removed = labels.is_removed(i);
    if (lies_within(pixel, 0)) {
      ++(removed ? scores.dynamic_removed : scores.dynamic_left);
    } else if (lies_within(pixel, rim_px)) {
      ++(removed ? scores.rim_removed : scores.rim_left);
    } else {
      ++(removed ? scores.static_removed : scores.static_left);
    }
  }
  return scores;
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_FEATURE_SCORES_HPP
