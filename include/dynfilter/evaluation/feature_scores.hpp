// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_FEATURE_SCORES_HPP
#define DYNFILTER_EVALUATION_FEATURE_SCORES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Definition of a dynamic feature. Either verdict on the rim is defensible, so scores are computed
/// both ways.
enum class DynamicTruth {
  silhouette,         ///< features on the exact silhouette; features on the rim are static
  silhouette_and_rim  ///< features on the rim are dynamic too
};

/// Rates of a detector of dynamic features. A rate of 0 / 0 is absent.
struct DetectionRates {
  /// Share of the dynamic features that is removed (recall).
  std::optional<double> true_positive_rate;
  std::optional<double> false_positive_rate;  ///< share of the static features that is removed
  std::optional<double> precision;            ///< share of the removed features that is dynamic
  std::optional<double> f1;                   ///< harmonic mean of recall and precision
};

/// Comparison of a filter's labels with the truth, in features. A feature is dynamic on the exact
/// silhouette of an object, and static more than `rim_px` outside every silhouette. Between them is
/// the rim, where an occlusion contour is not a landmark and either verdict is right.
struct FeatureScores {
  std::size_t dynamic_left = 0;     ///< dynamic features that are kept
  std::size_t dynamic_removed = 0;  ///< dynamic features that are removed
  std::size_t static_left = 0;      ///< static features that are kept
  std::size_t static_removed = 0;   ///< static features that are removed
  /// Part of static_removed whose depth is known. An RGB-D pose gains little from the others. 0 if
  /// the scores were made without a depth image.
  std::size_t static_removed_with_depth = 0;
  std::size_t rim_left = 0;     ///< features on the rim that are kept
  std::size_t rim_removed = 0;  ///< features on the rim that are removed

  /// Adds the counts of another frame.
  FeatureScores& operator+=(const FeatureScores& other) {
    dynamic_left += other.dynamic_left;
    dynamic_removed += other.dynamic_removed;
    static_left += other.static_left;
    static_removed += other.static_removed;
    static_removed_with_depth += other.static_removed_with_depth;
    rim_left += other.rim_left;
    rim_removed += other.rim_removed;
    return *this;
  }

  /// Returns the rates under one definition of a dynamic feature.
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

/// Place of a feature against the true instances.
enum class FeaturePlace : std::uint8_t {
  on_object,  ///< on the silhouette of an instance
  on_rim,     ///< beside one
  off         ///< farther away than the rim is wide
};

/// Finds the place of a feature's pixel. Distances are Euclidean, between pixel centres.
/// O(instances x rim_px^2).
inline FeaturePlace feature_place(cv::Point pixel, const Segmentation& truth, double rim_px) {
  const auto lies_within = [&](double distance) {
    for (const Instance& instance : truth.instances) {
      if (detail::mask_within(instance, pixel, distance)) return true;
    }
    return false;
  };
  if (lies_within(0)) return FeaturePlace::on_object;
  return lies_within(rim_px) ? FeaturePlace::on_rim : FeaturePlace::off;
}

/// Scores the labels of one frame. All instances of `truth` count as dynamic. Distances are
/// Euclidean, between pixel centres. `frame` gives the features' depth and may be empty. Throws
/// std::invalid_argument for a malformed truth and if labels and features differ in number.
/// O(features x instances x rim_px^2).
inline FeatureScores score_features(FeaturesView features, const FeatureLabels& labels,
                                    const Segmentation& truth, double rim_px = 3.0,
                                    const FrameView& frame = {}) {
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
    switch (feature_place(pixel, truth, rim_px)) {
      case FeaturePlace::on_object:
        ++(removed ? scores.dynamic_removed : scores.dynamic_left);
        break;
      case FeaturePlace::on_rim:
        ++(removed ? scores.rim_removed : scores.rim_left);
        break;
      case FeaturePlace::off:
        ++(removed ? scores.static_removed : scores.static_left);
        if (removed && frame.depth_m(pixel)) ++scores.static_removed_with_depth;
        break;
    }
  }
  return scores;
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_FEATURE_SCORES_HPP
