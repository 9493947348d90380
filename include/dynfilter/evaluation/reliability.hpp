// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_RELIABILITY_HPP
#define DYNFILTER_EVALUATION_RELIABILITY_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/feature_scores.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Predictions of about the same probability, and how often what they predict was so.
struct ReliabilityBin {
  std::size_t count = 0;     ///< number of predictions
  std::size_t happened = 0;  ///< number of them that came true
  double sum = 0;            ///< sum of the predicted probabilities

  /// Mean of the predicted probabilities; 0 without any.
  double predicted() const { return count == 0 ? 0 : sum / static_cast<double>(count); }
  /// Share that came true; 0 without any.
  double observed() const {
    return count == 0 ? 0 : static_cast<double>(happened) / static_cast<double>(count);
  }
};

/// Reliability table of predicted probabilities: ten bins of equal width, [0, 0.1) ... [0.9, 1].
/// Good probabilities come true as often as they say in every bin.
struct Reliability {
  std::array<ReliabilityBin, 10> bins;  ///< lowest probabilities first

  /// Adds a prediction. Throws std::invalid_argument for a probability outside 0 to 1.
  void add(double probability, bool happened) {
    if (!(probability >= 0 && probability <= 1)) {
      detail::throw_misuse("Reliability", detail::concatenate("the probability ", probability),
                           "a probability from 0 to 1");
    }
    ReliabilityBin& bin =
        bins[std::min(static_cast<std::size_t>(10 * probability), bins.size() - 1)];
    ++bin.count;
    bin.happened += happened ? 1 : 0;
    bin.sum += probability;
  }

  /// Adds the predictions of another table.
  Reliability& operator+=(const Reliability& other) {
    for (std::size_t k = 0; k < bins.size(); ++k) {
      bins[k].count += other.bins[k].count;
      bins[k].happened += other.bins[k].happened;
      bins[k].sum += other.bins[k].sum;
    }
    return *this;
  }

  /// Number of predictions.
  std::size_t count() const {
    std::size_t sum = 0;
    for (const ReliabilityBin& bin : bins) sum += bin.count;
    return sum;
  }

  /// Returns the expected calibration error: the mean over the predictions of the distance between
  /// predicted and observed in their bin. Nothing without predictions.
  std::optional<double> expected_calibration_error() const {
    if (count() == 0) return {};
    double sum = 0;
    for (const ReliabilityBin& bin : bins) {
      sum += std::abs(bin.sum - static_cast<double>(bin.happened));
    }
    return sum / static_cast<double>(count());
  }
};

/// Reliability of the weights of a frame's features.
struct WeightReliability {
  Reliability all;        ///< of every feature
  Reliability suspected;  ///< of those that are removed, given back, or have a score

  /// Adds the predictions of another frame.
  WeightReliability& operator+=(const WeightReliability& other) {
    all += other.all;
    suspected += other.suspected;
    return *this;
  }
};

/// Compares the weights of one frame's features with the truth, as score_features does its labels:
/// all instances of `truth` are dynamic, a feature is static more than `rim_px` outside each of
/// them, and those on the rim between count as neither. Most features are suspected by nobody, and
/// their weights are easy; so the suspected ones also have a table of their own. Throws
/// std::invalid_argument for a malformed truth, if labels, weights and features differ in number,
/// and for a weight outside 0 to 1. O(features x instances x rim_px^2).
inline WeightReliability score_weights(FeaturesView features, const FeatureLabels& labels,
                                       const std::vector<float>& weights, const Segmentation& truth,
                                       double rim_px = 3.0) {
  validate(truth, "score_weights");
  if (labels.size() != features.size() || weights.size() != features.size()) {
    detail::throw_misuse("score_weights",
                         detail::concatenate(labels.size(), " labels, ", weights.size(),
                                             " weights and ", features.size(), " features"),
                         "one label and one weight per feature");
  }
  WeightReliability reliability;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const FeaturePlace place = feature_place(features.pixel(i), truth, rim_px);
    if (place == FeaturePlace::on_rim) continue;
    const bool is_static = place == FeaturePlace::off;
    reliability.all.add(double{weights[i]}, is_static);
    const bool is_suspected = labels[i].reason != Reason::untouched || labels[i].score > 0;
    if (is_suspected) reliability.suspected.add(double{weights[i]}, is_static);
  }
  return reliability;
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_RELIABILITY_HPP
