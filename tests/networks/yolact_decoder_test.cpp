// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/yolact_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "detection_checks.hpp"
#include "random_tensors.hpp"
#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

using detail::bind_yolact;
using detail::decode_yolact;
using detail::Detection;
using detail::DetectionOptions;
using detail::NamedTensor;
using detail::rows_first;
using testing::expect_error;
using testing::expect_same;
using testing::options_of;
using testing::random_tensor;
using testing::tensor;

const cv::Size input(60, 40);
constexpr int prototype_count = 5;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

struct Outputs {
  cv::Mat locations, confidences, coefficients, prototypes, priors;

  std::vector<NamedTensor> tensors() const {
    return {
        {"loc", locations}, {"conf", confidences}, {"mask", coefficients}, {"proto", prototypes}};
  }
  int rows() const { return locations.size[1]; }
};

/// Random outputs with some overlapping boxes; logits or probabilities.
Outputs random_outputs(std::mt19937& random, int rows, int classes, bool are_logits) {
  Outputs outputs = {random_tensor(random, {1, rows, 4}, -2, 2),
                     random_tensor(random, {1, rows, classes + 1}, -3, 3),
                     random_tensor(random, {1, rows, prototype_count}, -1, 1),
                     random_tensor(random, {1, 6, 7, prototype_count}, 0, 1),
                     random_tensor(random, {rows, 4}, 0.2F, 0.6F)};
  if (are_logits) return outputs;
  for (int row = 0; row < rows; ++row) {
    float sum = 0;
    for (int c = 0; c <= classes; ++c) {
      float& value = outputs.confidences.at<float>(0, row, c);
      value = std::exp(value);
      sum += value;
    }
    for (int c = 0; c <= classes; ++c) outputs.confidences.at<float>(0, row, c) /= sum;
  }
  return outputs;
}

DetectionOptions decoding_of(float score, int max_detections = 100) {
  return options_of(score, 0.5F, max_detections);
}

std::vector<Detection> decoded(const Outputs& outputs, const DetectionOptions& decoding) {
  return decode_yolact(bind_yolact(outputs.tensors()), rows_first(outputs.priors), input, decoding);
}

/// Oracle: the published procedure, step by step, for all classes and scores.
std::vector<Detection> naive(const Outputs& outputs, bool are_logits,
                             const DetectionOptions& decoding) {
  const int classes = outputs.confidences.size[2] - 1;
  std::vector<std::vector<Detection>> of_class(static_cast<std::size_t>(classes));
  for (int row = 0; row < outputs.rows(); ++row) {
    std::vector<double> p;
    double sum = 0;
    for (int c = 0; c <= classes; ++c) {
      const double value = double{outputs.confidences.at<float>(0, row, c)};
      p.push_back(are_logits ? std::exp(value) : value);
      sum += p.back();
    }
    if (are_logits)
      for (double& value : p) value /= sum;
    if (!(*std::max_element(p.begin() + 1, p.end()) > 0.05)) continue;
    const auto l = [&](int i) { return double{outputs.locations.at<float>(0, row, i)}; };
    const auto prior = [&](int i) { return double{outputs.priors.at<float>(row, i)}; };
    const double cx = prior(0) + l(0) * 0.1 * prior(2), cy = prior(1) + l(1) * 0.1 * prior(3);
    const double w = prior(2) * std::exp(l(2) * 0.2), h = prior(3) * std::exp(l(3) * 0.2);
    Detection detection;
    detection.box = {float((cx - w / 2) * input.width), float((cy - h / 2) * input.height),
                     float((cx + w / 2) * input.width), float((cy + h / 2) * input.height)};
    for (int k = 0; k < prototype_count; ++k) {
      detection.coefficients.push_back(outputs.coefficients.at<float>(0, row, k));
    }
    for (int c = 0; c < classes; ++c) {
      detection.class_id = c;
      detection.score = float(p[std::size_t(c) + 1]);
      of_class[std::size_t(c)].push_back(detection);
    }
  }
  const auto by_score = [](const Detection& a, const Detection& b) { return a.score > b.score; };
  std::vector<Detection> result;
  for (std::vector<Detection>& candidates : of_class) {
    std::stable_sort(candidates.begin(), candidates.end(), by_score);
    if (candidates.size() > 200) candidates.resize(200);
    for (std::size_t j = 0; j < candidates.size(); ++j) {
      bool is_kept = true;
      for (std::size_t i = 0; i < j; ++i) {
        is_kept = is_kept && testing::overlap(candidates[i].box, candidates[j].box) <= 0.5;
      }
      if (is_kept) result.push_back(candidates[j]);
    }
  }
  std::stable_sort(result.begin(), result.end(), by_score);
  if (result.size() > std::size_t(decoding.max_detections))
    result.resize(std::size_t(decoding.max_detections));
  std::vector<Detection> above;
  for (const Detection& detection : result) {
    if (detection.score > decoding.score_threshold) above.push_back(detection);
  }
  return above;
}

TEST(YolactDecoder, MatchesThePublishedProcedure) {
  std::mt19937 random(1);
  std::size_t found = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const bool are_logits = trial % 2 == 0;
    const Outputs outputs =
        random_outputs(random, trial == 0 ? 400 : 40 + trial, trial % 3 == 0 ? 1 : 6, are_logits);
    const DetectionOptions decoding =
        decoding_of(trial % 4 == 0 ? 0 : 0.02F * float(trial % 20), trial % 7 == 0 ? 4 : 100);
    const std::vector<Detection> want = naive(outputs, are_logits, decoding);
    SCOPED_TRACE(trial);
    expect_same(decoded(outputs, decoding), want);
    found += want.size();
  }
  EXPECT_GT(found, 500U);
}

/// Priors at one place with sides 0.2; each row's location moves its box.
struct Placed {
  Outputs outputs;

  explicit Placed(int rows, int classes = 2)
      : outputs{tensor({1, rows, 4}), tensor({1, rows, classes + 1}),
                tensor({1, rows, prototype_count}), tensor({1, 6, 7, prototype_count}),
                tensor({rows, 4}, 0.2F)} {
    for (int row = 0; row < rows; ++row) outputs.confidences.at<float>(0, row, 0) = 1;
  }
  /// Sets a row's box by its left side and width, as fractions of the input, and its scores.
  void put(int row, float left, float width, std::vector<float> scores) {
    outputs.locations.at<float>(0, row, 0) = (left + width / 2 - 0.2F) / 0.02F;
    outputs.locations.at<float>(0, row, 2) = std::log(width / 0.2F) / 0.2F;
    float background = 1;
    for (std::size_t c = 0; c < scores.size(); ++c) {
      outputs.confidences.at<float>(0, row, int(c) + 1) = scores[c];
      background -= scores[c];
    }
    outputs.confidences.at<float>(0, row, 0) = background;
    outputs.coefficients.at<float>(0, row, 0) = float(row);
  }
  std::vector<int> rows_found(const DetectionOptions& decoding) const {
    std::vector<int> rows;
    for (const Detection& detection : decoded(outputs, decoding))
      rows.push_back(int(detection.coefficients[0]));
    return rows;
  }
};

TEST(YolactDecoder, FastSuppressionLetsDroppedRowsSuppress) {
  Placed placed(3);
  placed.put(0, 0.10F, 0.20F, {0.9F, 0});
  placed.put(1, 0.16F, 0.20F, {0.8F, 0});  // overlaps row 0 by 0.14 / 0.26
  placed.put(2, 0.22F, 0.20F, {0.7F, 0});  // overlaps row 1 equally, row 0 by 0.08 / 0.32
  EXPECT_EQ(placed.rows_found(decoding_of(0.15F)), (std::vector<int>{0}));
}

TEST(YolactDecoder, BoxIsAnInstanceOfEveryClassAboveTheThreshold) {
  Placed placed(1);
  placed.put(0, 0.1F, 0.2F, {0.3F, 0.6F});
  const std::vector<Detection> found = decoded(placed.outputs, decoding_of(0.15F));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].class_id, 1);
  EXPECT_FLOAT_EQ(found[0].score, 0.6F);
  EXPECT_EQ(found[1].class_id, 0);
  EXPECT_NEAR(found[0].box.x1, 6, 1e-4F);
  EXPECT_NEAR(found[0].box.x2, 18, 1e-4F);
  EXPECT_NEAR(found[0].box.y1, 4, 1e-4F);
  EXPECT_NEAR(found[0].box.y2, 12, 1e-4F);
}

TEST(YolactDecoder, DropsRowsWithNonFiniteNumbers) {
  for (const float bad : {nan, infinity, -infinity}) {
    for (int part = 0; part < 5; ++part) {
      Placed placed(2);
      placed.put(0, 0.1F, 0.2F, {0.9F, 0});
      placed.put(1, 0.6F, 0.2F, {0.8F, 0});
      Outputs& o = placed.outputs;
      cv::Mat* const parts[] = {&o.locations, &o.confidences, &o.coefficients};
      if (part < 3) parts[part]->at<float>(0, 0, 1) = bad;
      if (part == 3) o.priors.at<float>(0, 2) = bad;
      if (part == 4) o.confidences.at<float>(0, 0, 2) = bad;  // of a class that is not the best
      EXPECT_EQ(placed.rows_found(decoding_of(0.15F)), std::vector<int>{1})
          << bad << " in part " << part;
    }
  }
}

TEST(YolactDecoder, DistinguishesLogitsFromProbabilities) {
  std::mt19937 random(5);
  EXPECT_TRUE(
      detail::are_probabilities(rows_first(random_outputs(random, 300, 80, false).confidences)));
  EXPECT_FALSE(
      detail::are_probabilities(rows_first(random_outputs(random, 300, 80, true).confidences)));
  EXPECT_FALSE(detail::are_probabilities(rows_first(tensor({1, 3, 81}))));  // logits, all 0
  cv::Mat rows = tensor({1, 2, 3});
  rows.at<float>(0, 0, 1) = rows.at<float>(0, 1, 2) = 1;
  EXPECT_TRUE(detail::are_probabilities(rows_first(rows))) << "a probability may be 0";
  rows.at<float>(0, 1, 0) = -0.5F;
  rows.at<float>(0, 1, 1) = 0.5F;
  EXPECT_FALSE(detail::are_probabilities(rows_first(rows))) << "but not negative, whatever the sum";
}

// --- Binding -------------------------------------------------------------------------------------

TEST(YolactDecoder, BindsOutputsByShapeInAnyOrder) {
  std::mt19937 random(6);
  const Outputs o = random_outputs(random, 30, 6, true);
  const DetectionOptions decoding = decoding_of(0.15F);
  const std::vector<Detection> want = decoded(o, decoding);
  ASSERT_GT(want.size(), 3U);
  std::vector<NamedTensor> tensors = {{"5", o.priors},
                                      {"4", o.prototypes},
                                      {"3", o.coefficients},
                                      {"2", o.confidences},
                                      {"1", o.locations}};
  do {
    const detail::YolactOutputs bound = bind_yolact(tensors);
    ASSERT_EQ(bound.priors.rows, 30);
    ASSERT_EQ(bound.class_count(), 6);
    ASSERT_EQ(bound.prototypes.rows, 6);
    expect_same(decode_yolact(bound, bound.priors, input, decoding), want);
  } while (std::next_permutation(tensors.begin(), tensors.end(),
                                 [](const auto& a, const auto& b) { return a.name < b.name; }));
}

TEST(YolactDecoder, BindsOutputsOfEqualShapeByName) {
  std::mt19937 random(8);
  Outputs o =
      random_outputs(random, 30, prototype_count - 1, true);  // as many classes as prototypes
  const auto bound = bind_yolact(o.tensors());
  EXPECT_EQ(bound.confidences.data, o.confidences.ptr<float>());
  EXPECT_EQ(bound.coefficients.data, o.coefficients.ptr<float>());
  expect_error<std::runtime_error>(
      [&] {
        bind_yolact(
            {{"a", o.locations}, {"b", o.confidences}, {"c", o.coefficients}, {"d", o.prototypes}});
      },
      "unclear which output holds the coefficients");
  o = random_outputs(random, 30, 6, true);
  const cv::Mat priors = o.priors.reshape(1, {1, 30, 4});
  std::vector<NamedTensor> tensors = o.tensors();
  tensors.insert(tensors.begin(), {"anchors", priors});
  EXPECT_EQ(bind_yolact(tensors).priors.data, priors.ptr<float>());
  tensors[0].name = "x";
  EXPECT_EQ(bind_yolact(tensors).locations.data, o.locations.ptr<float>());
}

TEST(YolactDecoder, RefusesOtherOutputs) {
  std::mt19937 random(9);
  const Outputs o = random_outputs(random, 30, 6, true);
  const auto refused = [](const std::vector<NamedTensor>& tensors, const char* part) {
    expect_error<std::runtime_error>([&] { bind_yolact(tensors); }, part);
  };
  refused({}, "locations [1, N, 4] are missing");
  std::vector<NamedTensor> tensors = o.tensors();
  tensors[1].data = tensor({1, 29, 7});
  refused(tensors, "confidences [1, N, C+1] are missing");
  tensors = o.tensors();
  tensors[2].data = tensor({1, 30, 9});
  refused(tensors, "coefficients [1, N, P] with prototypes");
  tensors = o.tensors();
  tensors.push_back({"priors", tensor({29, 4})});
  refused(tensors, "29 priors for 30 locations");
  tensors = o.tensors();
  tensors.push_back({"x", tensor({1, 30, 4})});
  EXPECT_NO_THROW(bind_yolact(tensors));  // a tensor is called loc
  tensors[0].name = "y";
  refused(tensors, "unclear which output holds the locations");
}

}  // namespace
}  // namespace dynfilter
