// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/yolact_decoder.hpp"

#include "detection_checks.hpp"
#include "random_tensors.hpp"
#include "support/test.hpp"

namespace dynfilter {
namespace {

using namespace detail;
using testing::expect_failure;
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

/// Oracle: the published procedure, step by step, for all classes and scores, but with greedy
/// suppression.
std::vector<Detection> naive(const Outputs& outputs, bool are_logits,
                             const DetectionOptions& decoding) {
  const int classes = outputs.confidences.size[2] - 1;
  std::vector<Detection> rows;
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
      rows.push_back(detection);
    }
  }
  return testing::picked(rows, decoding);
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

TEST(YolactDecoder, DropsRowsWithNonFiniteNumbers) {
  std::mt19937 random(4);
  const auto random_copy = [&] { return random_outputs(random, 20, 3, false); };
  for (const float bad : {nan, infinity, -infinity}) {
    for (int part = 0; part < 4; ++part) {
      Outputs o = random_copy();
      cv::Mat* const parts[] = {&o.locations, &o.confidences, &o.coefficients, &o.priors};
      (part < 3 ? parts[part]->at<float>(0, 7, 2) : o.priors.at<float>(7, 2)) = bad;
      const std::vector<Detection> got = decoded(o, decoding_of(0.15F));
      o.coefficients.at<float>(0, 7, 0) = nan;  // another reason to drop the row
      expect_same(got, decoded(o, decoding_of(0.15F)));
      EXPECT_GT(got.size(), 3U);
      for (const Detection& one : got) EXPECT_TRUE(one.box.has_area());
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

// --- Priors --------------------------------------------------------------------------------------

struct Prior {
  int row;
  double x, y, side;
};

void expect_priors(const cv::Mat& priors, const std::vector<Prior>& expected) {
  for (const Prior& prior : expected) {
    const double want[] = {prior.x, prior.y, prior.side, prior.side};
    for (int column = 0; column < 4; ++column) {
      EXPECT_NEAR(priors.at<float>(prior.row, column), want[column], 1e-6) << prior.row;
    }
  }
}

TEST(YolactDecoder, PriorsAreSquares) {
  const cv::Mat priors = yolact_priors(19248, {550, 550});
  ASSERT_EQ(priors.rows, 19248);
  const double root = std::sqrt(0.5);
  expect_priors(priors, {{0, 0.5 / 69, 0.5 / 69, 24 / 550.0},
                         {1, 0.5 / 69, 0.5 / 69, 24 * root / 550},
                         {2, 0.5 / 69, 0.5 / 69, 24 / root / 550},
                         {3, 1.5 / 69, 0.5 / 69, 24 / 550.0},
                         {69 * 3, 0.5 / 69, 1.5 / 69, 24 / 550.0},
                         {69 * 69 * 3, 0.5 / 35, 0.5 / 35, 48 / 550.0},
                         {19247, 4.5 / 5, 4.5 / 5, 384 / root / 550}});
}

TEST(YolactDecoder, PriorsScaleWithTheInputTruncatedToPixels) {
  // Input 400 has maps of 50, 25, 13, 7, 4 cells and scales of 17, 34, 69, 139, 279.
  const int cells = 50 * 50 + 25 * 25 + 13 * 13 + 7 * 7 + 4 * 4;
  expect_priors(
      yolact_priors(3 * cells, {400, 400}),
      {{0, 0.5 / 50, 0.5 / 50, 17 / 400.0}, {3 * cells - 3, 3.5 / 4, 3.5 / 4, 279 / 400.0}});
}

TEST(YolactDecoder, PriorsOfYolactPlusHaveThreeScalesAndShapes) {
  const cv::Mat priors = yolact_priors(3 * 19248, {550, 550});
  ASSERT_EQ(priors.rows, 3 * 19248);
  for (int i = 0; i < 9; ++i) {  // of the first cell: three shapes of each scale
    const double ratio = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.5 : 2;
    const double scale = 24 * std::pow(2, i / 3 / 3.0);
    EXPECT_NEAR(priors.at<float>(i, 2) * 550, scale * std::sqrt(ratio), 1e-4) << i;
    EXPECT_NEAR(priors.at<float>(i, 3) * 550, scale / std::sqrt(ratio), 1e-4) << i;
    EXPECT_NEAR(priors.at<float>(9 + i, 0), 1.5 / 69, 1e-6) << i;
  }
  EXPECT_NEAR(priors.at<float>(3 * 19248 - 9, 2) * 550, 384, 1e-3);
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

TEST(YolactDecoder, RefusesOtherOutputs) {
  std::mt19937 random(9);
  const Outputs o = random_outputs(random, 30, 6, true);
  const auto refused = [](const std::vector<NamedTensor>& tensors, const char* part) {
    expect_failure([&] { bind_yolact(tensors); }, part);
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
