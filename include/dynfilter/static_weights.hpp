// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_STATIC_WEIGHTS_HPP
#define DYNFILTER_STATIC_WEIGHTS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Evidence behind a label. Each kind has a curve of its own from the label's score to the
/// probability that the feature is static.
enum class StaticEvidence : std::uint8_t {
  depth,            ///< masks and depth alone: kept, compensated or given back
  mask,             ///< masks and depth alone: on a mask
  mover_depth,      ///< as depth, and motion calls the instance moving, or there is none
  mover_mask,       ///< on the mask of an instance that motion calls moving
  undecided_depth,  ///< as depth, and motion has not decided about the instance
  undecided_mask,   ///< on the mask of an instance about which motion has not decided
  still,            ///< of an instance that stands still
  beside_mover,     ///< removed because it is beside an instance and does not look static
  moves,            ///< removed because it moves itself
  custom,           ///< removed by a stage of your own, whose score is the probability of motion
  robot             ///< on the static mask, which hides the robot's own parts
};

/// Number of kinds that have a curve; `custom` and `robot` have none.
constexpr std::size_t static_curves = 9;

/// Probability of being static at the certainties 0, 0.1 ... 1, with straight lines between. It
/// must not rise.
using StaticCurve = std::array<double, 11>;

/// Options of StaticWeights. The defaults were fitted to rendered scenes of seeds 11 to 13 and, the
/// first two, to the even frames of recorded ones too (bench/weight_calibration.cpp).
struct StaticWeightsOptions {
  /// One curve for each kind of evidence, in the order of StaticEvidence.
  std::array<StaticCurve, static_curves> curves = {{
      {.996, .957, .922, .838, .785, .624, .308, .115, .098, .098, .064},  // depth
      {.004, .004, .004, .004, .004, .004, .004, .004, .004, .004, .004},  // mask
      {.994, .993, .982, .974, .919, .786, .398, .168, .045, .038, .004},  // mover_depth
      {.001, .001, .001, .001, .001, .001, .001, .001, .001, .001, .001},  // mover_mask
      {1.00, .995, .969, .969, .962, .940, .680, .601, .550, .501, .311},  // undecided_depth
      {.499, .499, .499, .499, .499, .499, .499, .499, .499, .499, .499},  // undecided_mask
      {.998, .985, .982, .982, .982, .972, .843, .843, .843, .843, .843},  // still
      {.934, .934, .934, .934, .934, .934, .934, .934, .934, .934, .934},  // beside_mover
      {.457, .457, .457, .457, .457, .457, .341, .253, .253, .097, .014},  // moves
  }};
};

/// Turns labels into weights: the probability that each feature is static. For hosts that weigh
/// features instead of removing them.
///
/// A label's score is the detector's confidence times a certainty, which is no probability. This
/// class divides the confidence out again and looks the certainty up in a curve. There is one curve
/// for each kind of evidence: a reason, and what motion says of the instance. Labels of motion have
/// no confidence in their scores; there, the score itself is looked up. Within a kind, the weight
/// never rises with the score.
///
/// Calibrated means: of the features with weight 0.3, 30 % are static. It holds for the labels of
/// rule depth, with or without MotionJudge, in frames with masks and depth (evaluation/
/// reliability.hpp measures it; bench/README.md has the figures). Without motion, static means off
/// every person; with motion, not moving in this frame. It does not hold for rules mask and paper,
/// nor where no masks are known: there, kept features get the weight of rule depth, which is too
/// high. Nor does it cover false detections: the weight takes an instance for what its class says,
/// whatever the confidence. The weights of an instance about which motion has not decided are the
/// least sure: they say how many such instances stood still in the scenes of the fit, images of
/// 640x480, in which motion decides within a few frames.
///
/// Where to put such a weight, and what to leave alone, is in examples/orb_slam/README.md.
class StaticWeights {
 public:
  /// Takes the curves. Throws std::invalid_argument for a probability outside 0 to 1 and for a
  /// curve that rises.
  explicit StaticWeights(const StaticWeightsOptions& options = {}) : options_(options) {
    for (std::size_t k = 0; k < static_curves; ++k) {
      double before = 1;
      for (const double probability : options_.curves[k]) {
        if (!(probability >= 0 && probability <= before)) {
          detail::throw_misuse(
              "StaticWeights",
              detail::concatenate("probability ", probability, " in curve ", k, " after ", before),
              "probabilities from 0 to 1 that do not rise");
        }
        before = probability;
      }
    }
  }

  /// Fills `weights` with one probability a feature, in the features' order. Allocates only to
  /// enlarge `weights`. O(features).
  void operator()(const FeatureLabels& labels, std::vector<float>& weights) const {
    weights.resize(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i) weights[i] = weight(labels, i);
  }

  /// Returns the evidence behind label i, which must be below labels.size().
  static StaticEvidence evidence(const FeatureLabels& labels, std::size_t i) {
    const FeatureLabel& label = labels[i];
    if (label.reason >= Reason::custom) return StaticEvidence::custom;
    if (label.reason == Reason::moving) {
      return label.instance < 0 ? StaticEvidence::moves : StaticEvidence::beside_mover;
    }
    const bool is_on_mask = label.reason == Reason::in_mask;
    if (is_on_mask && label.instance < 0) return StaticEvidence::robot;
    if (labels.statistics().motion.outcome != MotionOutcome::applied) {
      return is_on_mask ? StaticEvidence::mask : StaticEvidence::depth;
    }
    switch (verdict(labels, label)) {
      case InstanceVerdict::still:
        return StaticEvidence::still;
      case InstanceVerdict::undecided:
        return is_on_mask ? StaticEvidence::undecided_mask : StaticEvidence::undecided_depth;
      case InstanceVerdict::not_judged:
      case InstanceVerdict::moving:
        break;
    }
    return is_on_mask ? StaticEvidence::mover_mask : StaticEvidence::mover_depth;
  }

  /// Returns the place on the evidence's curve for label i: how certainly the feature belongs to
  /// its instance, or moves. From 0 to 1.
  static double certainty(const FeatureLabels& labels, std::size_t i) {
    const FeatureLabel& label = labels[i];
    const double score = double{label.score};
    if (label.reason == Reason::moving || label.instance < 0) return score;
    const double confidence = double{instance_of(labels, label).score};
    return confidence > score ? score / confidence : 1.0;
  }

 private:
  static const InstanceStatistics& instance_of(const FeatureLabels& labels,
                                               const FeatureLabel& label) {
    return labels.statistics().instances[static_cast<std::size_t>(label.instance)];
  }

  static InstanceVerdict verdict(const FeatureLabels& labels, const FeatureLabel& label) {
    if (label.instance < 0) return InstanceVerdict::not_judged;
    return instance_of(labels, label).verdict;
  }

  float weight(const FeatureLabels& labels, std::size_t i) const {
    const StaticEvidence kind = evidence(labels, i);
    if (kind == StaticEvidence::robot) return 0.0F;
    if (kind == StaticEvidence::custom) return 1.0F - labels[i].score;
    const StaticCurve& curve = options_.curves[static_cast<std::size_t>(kind)];
    const double place = 10 * certainty(labels, i);
    const auto below = std::min(static_cast<std::size_t>(place), curve.size() - 2);
    const double beyond = place - static_cast<double>(below);
    return static_cast<float>((1 - beyond) * curve[below] + beyond * curve[below + 1]);
  }

  StaticWeightsOptions options_;
};

/// Returns the weights of StaticWeights with its defaults: one probability a feature. O(features).
inline std::vector<float> static_weights(const FeatureLabels& labels) {
  std::vector<float> weights;
  StaticWeights()(labels, weights);
  return weights;
}

}  // namespace dynfilter

#endif  // DYNFILTER_STATIC_WEIGHTS_HPP
