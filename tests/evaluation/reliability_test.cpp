// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/reliability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "support/expect_error.hpp"
#include "support/oracle.hpp"

namespace dynfilter::testing {
namespace {

using Predictions = std::vector<std::pair<double, bool>>;

/// Goes through all predictions once for every bin.
double oracle_error(const Predictions& predictions) {
  double error = 0;
  for (int bin = 0; bin < 10; ++bin) {
    double count = 0, came_true = 0, sum = 0;
    for (const auto& [probability, happened] : predictions) {
      const bool is_in = probability >= bin / 10.0 &&
                         (probability < (bin + 1) / 10.0 || (bin == 9 && probability == 1));
      if (!is_in) continue;
      count += 1;
      came_true += happened ? 1 : 0;
      sum += probability;
    }
    if (count > 0) {
      error += count / static_cast<double>(predictions.size()) *
               std::abs(sum / count - came_true / count);
    }
  }
  return error;
}

Predictions draw(std::mt19937& random, std::size_t count) {
  Predictions predictions;
  for (std::size_t i = 0; i < count; ++i) {
    const double probability = static_cast<double>(random() % 4097) / 4096;
    predictions.emplace_back(probability, random() % 3 == 0);
  }
  return predictions;
}

Reliability table_of(const Predictions& predictions) {
  Reliability reliability;
  for (const auto& [probability, happened] : predictions) reliability.add(probability, happened);
  return reliability;
}

TEST(Reliability, MatchesTheOracle) {
  std::mt19937 random(1);
  for (std::size_t count = 1; count < 300; ++count) {
    const Predictions predictions = draw(random, count);
    const Reliability reliability = table_of(predictions);
    ASSERT_EQ(reliability.count(), count);
    ASSERT_NEAR(*reliability.expected_calibration_error(), oracle_error(predictions), 1e-12);
  }
}

TEST(Reliability, AddsTables) {
  std::mt19937 random(2);
  Predictions first = draw(random, 100), second = draw(random, 50);
  Reliability sum = table_of(first);
  sum += table_of(second);
  first.insert(first.end(), second.begin(), second.end());
  EXPECT_NEAR(*sum.expected_calibration_error(), oracle_error(first), 1e-12);
}

TEST(Reliability, HasBinsOfATenth) {
  const Reliability reliability = table_of({{0, false}, {0.099, true}, {0.5, true}, {1, true}});
  EXPECT_EQ(reliability.bins[0].count, 2U);
  EXPECT_DOUBLE_EQ(reliability.bins[0].predicted(), 0.0495);
  EXPECT_DOUBLE_EQ(reliability.bins[0].observed(), 0.5);
  EXPECT_EQ(reliability.bins[5].count, 1U);
  EXPECT_EQ(reliability.bins[9].count, 1U);
  EXPECT_DOUBLE_EQ(reliability.bins[3].predicted(), 0);
  EXPECT_DOUBLE_EQ(reliability.bins[3].observed(), 0);
}

TEST(Reliability, HasNoErrorWithoutPredictions) {
  EXPECT_FALSE(Reliability().expected_calibration_error().has_value());
}

TEST(Reliability, RefusesWhatIsNoProbability) {
  for (const double wrong : {-0.01, 1.01, static_cast<double>(NAN)}) {
    expect_error<std::invalid_argument>([&] { Reliability().add(wrong, true); }, "from 0 to 1");
  }
}

TEST(WeightReliability, CountsNeitherTheRimNorUnsuspectedFeaturesAsSuspected) {
  Segmentation truth;
  truth.instances = {Instance::from_image_mask(cv::Mat(1, 1, CV_8UC1, cv::Scalar(255)))};
  truth.instances[0].mask_origin = {10, 10};
  truth.image_size = {30, 30};
  const std::vector<cv::Point2f> features = {{10, 10}, {12, 10}, {13, 10}, {14, 10}, {20, 10}};
  FeatureLabels labels(features.size(), truth);
  labels.remove(0, 0, Reason::in_mask, 0.9F);
  labels.remove(1, 0, Reason::in_mask, 0.9F);
  labels.suspect(3, 0, 0.2F);
  const WeightReliability table =
      score_weights(features, labels, {0.05F, 0.05F, 0.95F, 0.75F, 0.95F}, truth, 3);
  EXPECT_EQ(table.all.count(), 3U);  // not those at 2 and 3 pixels
  EXPECT_EQ(table.all.bins[0].happened, 0U);
  EXPECT_EQ(table.all.bins[7].happened, 1U);
  EXPECT_EQ(table.all.bins[9].happened, 1U);
  EXPECT_EQ(table.suspected.count(), 2U);
  EXPECT_EQ(table.suspected.bins[9].count, 0U);
}

TEST(WeightReliability, CountsTheFeaturesThatFeatureScoresCount) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    FeatureLabels labels(input.keypoints.size(), input.segmentation);
    const std::vector<float> weights(labels.size(), 0.5F);
    const FeatureScores scores = score_features(input.keypoints, labels, input.segmentation);
    const Reliability table =
        score_weights(input.keypoints, labels, weights, input.segmentation).all;
    ASSERT_EQ(table.bins[5].count, scores.dynamic_left + scores.static_left) << "seed " << seed;
    ASSERT_EQ(table.bins[5].happened, scores.static_left) << "seed " << seed;
  }
}

TEST(WeightReliability, RefusesOtherNumbersOfLabelsOrWeights) {
  const std::vector<cv::Point2f> features = {{1, 1}, {2, 2}};
  const auto score = [&](std::size_t labels, std::size_t weights) {
    score_weights(features, FeatureLabels(labels, {}), std::vector<float>(weights, 0.5F), {});
  };
  EXPECT_NO_THROW(score(2, 2));
  expect_error<std::invalid_argument>([&] { score(1, 2); }, "1 labels, 2 weights and 2 features");
  expect_error<std::invalid_argument>([&] { score(2, 3); }, "one weight per feature");
}

}  // namespace
}  // namespace dynfilter::testing
