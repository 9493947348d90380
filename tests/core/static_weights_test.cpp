// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/static_weights.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

constexpr auto some_reason = static_cast<Reason>(130);

Segmentation two_instances() {
  Segmentation segmentation;
  segmentation.instances = {Instance::from_box({0, 0, 9, 9}, 0, 0.8F),
                            Instance::from_box({9, 9, 9, 9}, 0, 0.5F)};
  return segmentation;
}

/// Labels of every kind, in a frame in which motion judged, or not.
FeatureLabels arbitrary_labels(std::mt19937& random) {
  const auto chance = [&](int of) { return static_cast<int>(random() % 1000) % of; };
  FeatureLabels labels(200, two_instances());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const std::int32_t instance = chance(3) - 1;
    const float confidence = instance < 0 ? 1.0F : instance == 0 ? 0.8F : 0.5F;
    const float score = confidence * static_cast<float>(chance(101)) / 100;
    const Reason reasons[] = {Reason::in_mask, Reason::compensated, Reason::moving, some_reason};
    if (chance(3) > 0) labels.remove(i, instance, reasons[chance(4)], score);
    if (chance(3) == 0) labels.restore(i, score / 2);
    labels.suspect(i, instance, score / 3);
  }
  FrameStatistics& statistics = labels.statistics();
  statistics.motion.outcome = chance(2) > 0 ? MotionOutcome::applied : MotionOutcome::not_run;
  statistics.instances[0].verdict = static_cast<InstanceVerdict>(chance(4));
  statistics.instances[1].verdict = static_cast<InstanceVerdict>(chance(4));
  return labels;
}

/// Reads the rules of StaticEvidence as they are written.
float oracle_weight(const FeatureLabels& labels, std::size_t i) {
  const FeatureLabel& label = labels[i];
  if (label.reason >= Reason::custom) return 1 - label.score;
  if (label.reason == Reason::in_mask && label.instance == -1) return 0;
  const bool judged = labels.statistics().motion.outcome == MotionOutcome::applied;
  InstanceVerdict verdict = InstanceVerdict::not_judged;
  if (label.instance >= 0) {
    verdict = labels.statistics().instances.at(static_cast<std::size_t>(label.instance)).verdict;
  }
  std::size_t curve = label.reason == Reason::in_mask ? 1 : 0;
  if (judged) curve += 2;
  if (judged && verdict == InstanceVerdict::undecided) curve += 2;
  if (judged && verdict == InstanceVerdict::still) curve = 6;
  if (label.reason == Reason::moving) curve = label.instance >= 0 ? 7 : 8;
  double certainty = double{label.score};
  const bool from_motion = label.reason == Reason::moving;
  if (!from_motion && label.instance == 0) certainty /= double{0.8F};
  if (!from_motion && label.instance == 1) certainty /= double{0.5F};
  certainty = std::min(certainty, 1.0);
  const auto points = StaticWeightsOptions().curves.at(curve);
  double weight = 0;  // a sum of hats: each point counts up to its neighbours
  for (int k = 0; k <= 10; ++k) {
    const double hat = std::max(0.0, 1 - std::abs(10 * certainty - k));
    weight += hat * points.at(static_cast<std::size_t>(k));
  }
  return static_cast<float>(weight);
}

TEST(StaticWeights, MatchTheOracleOnArbitraryLabels) {
  std::mt19937 random(1);
  std::vector<float> weights;
  for (int round = 0; round < 500; ++round) {
    const FeatureLabels labels = arbitrary_labels(random);
    StaticWeights()(labels, weights);
    ASSERT_EQ(weights.size(), labels.size());
    ASSERT_EQ(static_weights(labels), weights);
    for (std::size_t i = 0; i < weights.size(); ++i) {
      ASSERT_NEAR(weights[i], oracle_weight(labels, i), 1e-6) << "feature " << i;
      ASSERT_TRUE(weights[i] >= 0 && weights[i] <= 1);
    }
  }
}

TEST(StaticWeights, NeverRiseWithTheScore) {
  for (const MotionOutcome outcome : {MotionOutcome::not_run, MotionOutcome::applied}) {
    for (int verdict = 0; verdict < 4; ++verdict) {
      for (const Reason reason : {Reason::untouched, Reason::in_mask, Reason::compensated,
                                  Reason::restored, Reason::moving, Reason::custom}) {
        for (const std::int32_t instance : {-1, 0}) {
          FeatureLabels labels(81, two_instances());
          labels.statistics().motion.outcome = outcome;
          labels.statistics().instances[0].verdict = static_cast<InstanceVerdict>(verdict);
          for (std::size_t i = 0; i < labels.size(); ++i) {
            // From 0.01 on: a feature of score 0 has no instance.
            const float score = static_cast<float>(i + 1) / 100;
            if (reason == Reason::untouched) {
              labels.suspect(i, instance, score);
            } else {
              labels.remove(i, instance, reason == Reason::restored ? Reason::in_mask : reason,
                            score);
              if (reason == Reason::restored) labels.restore(i);
            }
          }
          const std::vector<float> weights = static_weights(labels);
          for (std::size_t i = 1; i < weights.size(); ++i) {
            ASSERT_LE(weights[i], weights[i - 1])
                << "reason " << static_cast<int>(reason) << ", verdict " << verdict;
          }
        }
      }
    }
  }
}

TEST(StaticWeights, AreTheHighestOfTheirCurveForFeaturesThatNobodySuspects) {
  FeatureLabels labels(1, {});
  EXPECT_FLOAT_EQ(static_weights(labels)[0], 0.996F);
  labels.statistics().motion.outcome = MotionOutcome::applied;
  EXPECT_FLOAT_EQ(static_weights(labels)[0], 0.994F);
}

TEST(StaticWeights, DoNotDependOnTheDetectorsConfidence) {
  FeatureLabels labels(2, two_instances());
  labels.remove(0, 0, Reason::compensated, 0.8F * 0.6F);
  labels.remove(1, 1, Reason::compensated, 0.5F * 0.6F);
  const std::vector<float> weights = static_weights(labels);
  EXPECT_NEAR(weights[0], 0.308, 1e-6);
  EXPECT_NEAR(weights[1], 0.308, 1e-6);
}

TEST(StaticWeights, KeepTheRobotAtZeroAndTakeACustomScoreAsItIs) {
  FeatureLabels labels(2, {});
  labels.remove(0, -1, Reason::in_mask, 1.0F);
  labels.remove(1, -1, some_reason, 0.3F);
  EXPECT_EQ(static_weights(labels), (std::vector<float>{0.0F, 0.7F}));
}

TEST(StaticWeights, RefuseCurvesThatAreNoneOfFallingProbabilities) {
  const auto make = [](double at_4, double at_5) {
    StaticWeightsOptions options;
    options.curves[2] = {1, 1, 1, 1, at_4, at_5, 0, 0, 0, 0, 0};
    return StaticWeights(options);
  };
  EXPECT_NO_THROW(make(0.5, 0.5));
  for (const auto& [at_4, at_5] : {std::pair(0.4, 0.5), {1.1, 0.5}, {0.5, -0.1}, {0.5, NAN}}) {
    expect_error<std::invalid_argument>([&, a = at_4, b = at_5] { make(a, b); }, "StaticWeights");
    expect_error<std::invalid_argument>([&, a = at_4, b = at_5] { make(a, b); }, "curve 2");
  }
}

}  // namespace
}  // namespace dynfilter::testing
