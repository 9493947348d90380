// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_FEATURE_SCORES_HPP
#define DYNFILTER_EVALUATION_FEATURE_SCORES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <optional>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// What counts as dynamic: the rim is a question of taste, so scores are given both ways.
enum class DynamicTruth {
  silhouette,         ///< features on the exact silhouette; those on the rim are static
  silhouette_and_rim  ///< features on the rim are dynamic too
};

/// The usual rates of a detector of dynamic features; nothing where a rate would be 0 / 0.
struct DetectionRates {
  std::optional<double> true_positive_rate;   ///< of the dynamic features, those removed (recall)
  std::optional<double> false_positive_rate;  ///< of the static features, those removed
  std::optional<double> precision;            ///< of the removed features, those dynamic
  std::optional<double> f1;                   ///< harmonic mean of recall and precision
};

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

  DetectionRates rates(DynamicTruth truth) const {
    const bool with_rim = truth == DynamicTruth::silhouette_and_rim;
    const std::size_t true_positives = dynamic_removed + (with_rim ? rim_removed : 0);
    const std::size_t false_negatives = dynamic_left + (with_rim ? rim_left : 0);
    const std::size_t false_positives = static_removed + (with_rim ? 0 : rim_removed);
    const std::size_t true_negatives = static_left + (with_rim ? 0 : rim_left);
    DetectionRates rates;
    rates.true_positive_rate = share(true_positives, true_positives + false_negatives);
    rates.false_positive_rate = share(false_positives, false_positives + true_negatives);
    rates.precision = share(true_positives, true_positives + false_positives);
    rates.f1 = share(2 * true_positives, 2 * true_positives + false_positives + false_negatives);
    return rates;
  }

 private:
  static std::optional<double> share(std::size_t part, std::size_t whole) {
    if (whole == 0) return {};
    return static_cast<double>(part) / static_cast<double>(whole);
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
