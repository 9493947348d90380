// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/yolo_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "detection_checks.hpp"
#include "random_tensors.hpp"
#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

using detail::bind_yolo;
using detail::Box;
using detail::decode_yolo;
using detail::Detection;
using detail::DetectionOptions;
using detail::NamedTensor;
using detail::YoloHead;
using detail::YoloOutputs;
using testing::count_last;
using testing::expect_error;
using testing::expect_same;
using testing::options_of;
using testing::random_tensor;
using testing::tensor;
using testing::turned;

const cv::Size input(64, 32);  // 8x4 + 4x2 + 2x1 = 42 anchors
constexpr int anchors = 42;
constexpr int prototype_count = 5;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

/// Centre and side of every cell, in the order of the anchors.
std::vector<cv::Vec3f> cells() {
  std::vector<cv::Vec3f> result;
  for (const int stride : {8, 16, 32}) {
    for (int y = 0; y < input.height / stride; ++y) {
      for (int x = 0; x < input.width / stride; ++x) {
        result.emplace_back((float(x) + 0.5F) * float(stride), (float(y) + 0.5F) * float(stride),
                            float(stride));
      }
    }
  }
  return result;
}

/// Raw outputs of a network: [1, 4 bins, N], [1, classes, N], [1, prototypes, N], prototypes.
struct RawHeads {
  cv::Mat boxes, classes, coefficients, prototypes;

  std::vector<NamedTensor> outputs() const {
    return {{"output0", boxes},
            {"output1", classes},
            {"output2", coefficients},
            {"output3", prototypes}};
  }
};

RawHeads random_heads(std::mt19937& random, int classes, float logit = 3, int bins = 16) {
  return {random_tensor(random, {1, 4 * bins, anchors}, -2, 2),
          random_tensor(random, {1, classes, anchors}, -logit, logit),
          random_tensor(random, {1, prototype_count, anchors}, -1, 1),
          random_tensor(random, {1, prototype_count, 8, 16}, -1, 1)};
}

/// Oracle: decodes the rows one by one.
std::vector<Detection> rows_of(const RawHeads& heads) {
  std::vector<Detection> rows;
  const int bins = heads.boxes.size[1] / 4;
  for (int a = 0; a < anchors; ++a) {
    Detection row;
    double distance[4];
    for (int side = 0; side < 4; ++side) {
      double sum = 0, weighted = 0;
      for (int k = 0; k < bins; ++k) {
        const double weight = std::exp(double{heads.boxes.at<float>(0, side * bins + k, a)});
        sum += weight;
        weighted += k * weight;
      }
      distance[side] = weighted / sum;
    }
    const cv::Vec3f cell = cells()[std::size_t(a)];
    row.box = {float(cell[0] - distance[0] * cell[2]), float(cell[1] - distance[1] * cell[2]),
               float(cell[0] + distance[2] * cell[2]), float(cell[1] + distance[3] * cell[2])};
    float best = -infinity;
    for (int c = 0; c < heads.classes.size[1]; ++c) {
      const float logit = heads.classes.at<float>(0, c, a);
      if (logit > best) {
        best = logit;
        row.class_id = c;
      }
    }
    row.score = float(1 / (1 + std::exp(-double{best})));
    for (int k = 0; k < prototype_count; ++k) {
      row.coefficients.push_back(heads.coefficients.at<float>(0, k, a));
    }
    rows.push_back(row);
  }
  return rows;
}

/// Oracle of suppression: repeatedly picks the best remaining row.
std::vector<Detection> picked(std::vector<Detection> rows, const DetectionOptions& options) {
  std::vector<Detection> result;
  while (result.size() < std::size_t(options.max_detections)) {
    const Detection* best = nullptr;
    for (const Detection& row : rows) {
      if (row.score > options.score_threshold && options.is_wanted(row.class_id) &&
          (best == nullptr || row.score > best->score)) {
        best = &row;
      }
    }
    if (best == nullptr) break;
    result.push_back(*best);
    for (Detection& row : rows) {
      if (row.class_id == result.back().class_id &&
          testing::overlap(row.box, result.back().box) > double{options.iou_threshold}) {
        row.score = -1;
      }
    }
    for (Detection& row : rows) {
      if (row.box.x1 == result.back().box.x1 && row.score == result.back().score) row.score = -1;
    }
  }
  return result;
}

/// Output of a network that decodes the same rows itself: [1, 4 + classes + P, N].
cv::Mat decoded_output(const RawHeads& heads) {
  const std::vector<Detection> rows = rows_of(heads);
  const int classes = heads.classes.size[1];
  cv::Mat output = tensor({1, 4 + classes + prototype_count, anchors});
  for (int a = 0; a < anchors; ++a) {
    const Detection& row = rows[std::size_t(a)];
    output.at<float>(0, 0, a) = (row.box.x1 + row.box.x2) / 2;
    output.at<float>(0, 1, a) = (row.box.y1 + row.box.y2) / 2;
    output.at<float>(0, 2, a) = row.box.x2 - row.box.x1;
    output.at<float>(0, 3, a) = row.box.y2 - row.box.y1;
    for (int c = 0; c < classes; ++c) {
      output.at<float>(0, 4 + c, a) = 1 / (1 + std::exp(-heads.classes.at<float>(0, c, a)));
    }
    for (int k = 0; k < prototype_count; ++k) {
      output.at<float>(0, 4 + classes + k, a) = row.coefficients[std::size_t(k)];
    }
  }
  return output;
}

std::vector<Detection> decoded(const std::vector<NamedTensor>& outputs,
                               const DetectionOptions& options = options_of(0.5F, 0.5F, 300)) {
  return decode_yolo(bind_yolo(outputs, input), options);
}

// --- Against the oracle --------------------------------------------------------------------------

TEST(YoloDecoder, MatchesANaiveDecoder) {
  std::mt19937 random(1);
  std::size_t found = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const int classes = trial % 3 == 0 ? 1 : 7;
    const RawHeads heads = random_heads(random, classes, 3, trial % 5 == 0 ? 8 : 16);
    const DetectionOptions options = options_of(
        0.5F + 0.01F * float(trial % 40), 0.3F + 0.1F * float(trial % 5), trial % 4 == 0 ? 3 : 300);
    const std::vector<Detection> want = picked(rows_of(heads), options);
    expect_same(decoded(heads.outputs(), options), want);
    expect_same(
        decoded({{"output0", decoded_output(heads)}, {"output1", heads.prototypes}}, options),
        want);
    found += want.size();
  }
  EXPECT_GT(found, 300U);
}

TEST(YoloDecoder, ReadsEveryOutputLayout) {
  std::mt19937 random(2);
  const RawHeads heads = random_heads(random, 7);
  const std::vector<Detection> want = decoded(heads.outputs());
  ASSERT_GT(want.size(), 3U);
  const cv::Mat last = count_last(heads.prototypes);
  cv::Mat joined = tensor({1, 64 + 7, anchors});
  std::copy_n(heads.boxes.ptr<float>(), heads.boxes.total(), joined.ptr<float>());
  std::copy_n(heads.classes.ptr<float>(), heads.classes.total(), joined.ptr<float>(0, 64));
  const cv::Mat decoded_boxes = decoded_output(heads);
  const std::vector<std::vector<NamedTensor>> arrangements = {
      {{"p", heads.prototypes},
       {"c", heads.coefficients},
       {"s", heads.classes},
       {"b", heads.boxes}},
      {{"b", turned(heads.boxes)},
       {"s", turned(heads.classes)},
       {"c", turned(heads.coefficients)},
       {"p", last}},
      {{"joined", joined}, {"c", heads.coefficients}, {"p", heads.prototypes}},
      {{"c", heads.coefficients}, {"joined", turned(joined)}, {"p", last}},
      {{"p", last}, {"o", decoded_boxes}},
      {{"o", turned(decoded_boxes)}, {"p", heads.prototypes}},
  };
  for (const std::vector<NamedTensor>& outputs : arrangements) {
    SCOPED_TRACE(detail::shapes_text(outputs));
    expect_same(decoded(outputs), want);
    const YoloOutputs bound = bind_yolo(outputs, input);
    EXPECT_EQ(bound.class_count(), 7);
    ASSERT_EQ(bound.prototypes.count, prototype_count);
    ASSERT_EQ(bound.prototypes.rows, 8);
    ASSERT_EQ(bound.prototypes.columns, 16);
    const detail::Prototypes& p = bound.prototypes;
    EXPECT_EQ(p.data[3 * p.prototype_step + 37 * p.cell_step],
              heads.prototypes.at<float>(cv::Vec4i(0, 3, 2, 5)));
  }
}

TEST(YoloDecoder, BindsOutputsOfEqualShapeByNameThenOrder) {
  std::mt19937 random(3);
  RawHeads heads = random_heads(random, prototype_count);  // as many classes as prototypes
  const std::vector<Detection> want = picked(rows_of(heads), options_of(0.5F, 0.5F, 300));
  expect_same(decoded(heads.outputs()), want);
  expect_same(decoded({{"coefficients", heads.coefficients},
                       {"classes", heads.classes},
                       {"boxes", heads.boxes},
                       {"prototypes", heads.prototypes}}),
              want);

  heads = random_heads(random, 64);  // as many classes as columns of boxes
  const std::vector<Detection> others = picked(rows_of(heads), options_of(0.5F, 0.5F, 300));
  expect_same(decoded(heads.outputs()), others);
  expect_same(decoded({{"classes", heads.classes},
                       {"boxes", heads.boxes},
                       {"coefficients", heads.coefficients},
                       {"prototypes", heads.prototypes}}),
              others);
}

// --- Known by hand -------------------------------------------------------------------------------

/// Decoded output of a network with two classes, at first without detections.
struct Decoded {
  cv::Mat output = tensor({1, 4 + 2 + prototype_count, anchors});
  cv::Mat prototypes = tensor({1, prototype_count, 8, 16});

  void put(int row, const Box& box, float first_class, float second_class) {
    const float values[] = {(box.x1 + box.x2) / 2,
                            (box.y1 + box.y2) / 2,
                            box.x2 - box.x1,
                            box.y2 - box.y1,
                            first_class,
                            second_class,
                            1,
                            2,
                            3,
                            4,
                            5};
    for (int i = 0; i < 11; ++i) output.at<float>(0, i, row) = values[i];
  }

  std::vector<Detection> detections(const DetectionOptions& options = options_of(0.25F, 0.5F,
                                                                                 300)) const {
    return decoded({{"output0", output}, {"output1", prototypes}}, options);
  }
};

TEST(YoloDecoder, FindsNothingWithoutScores) { EXPECT_TRUE(Decoded().detections().empty()); }

TEST(YoloDecoder, EqualScoresGoToTheLowestClassAndFirstRow) {
  Decoded network;
  network.put(7, {0, 0, 10, 10}, 0.5F, 0.5F);
  network.put(5, {1, 0, 11, 10}, 0.5F, 0.5F);
  network.put(9, {30, 0, 40, 10}, 0.5F, 0.2F);
  const std::vector<Detection> found = network.detections();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_FLOAT_EQ(found[0].box.x1, 1);
  EXPECT_EQ(found[0].class_id, 0);
  EXPECT_FLOAT_EQ(found[1].box.x1, 30);
  EXPECT_EQ(found[1].coefficients, (std::vector<float>{1, 2, 3, 4, 5}));
}

TEST(YoloDecoder, SuppressesOnlyWithinAClassAboveTheThreshold) {
  Decoded network;
  network.put(0, {0, 0, 20, 10}, 0.9F, 0);
  network.put(1, {0, 0, 10, 10}, 0.8F, 0);     // overlap 0.5 with row 0: not above 0.5
  network.put(2, {0, 0, 10.5F, 10}, 0.7F, 0);  // above 0.5 with both
  network.put(3, {0, 0, 20, 10}, 0, 0.6F);     // another class
  const std::vector<Detection> found = network.detections();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_FLOAT_EQ(found[1].score, 0.8F);
  EXPECT_EQ(found[2].class_id, 1);
}

TEST(YoloDecoder, ScoresMustExceedTheThreshold) {
  Decoded network;
  network.put(0, {0, 0, 20, 10}, 0.25F, 0);
  EXPECT_TRUE(network.detections().empty());
}

TEST(YoloDecoder, RowsOfAnUnwantedBestClassAreDropped) {
  Decoded network;
  network.put(0, {0, 0, 20, 10}, 0.5F, 0.6F);
  network.put(1, {30, 0, 50, 10}, 0.5F, 0.4F);
  DetectionOptions options = options_of(0.25F, 0.5F, 300);
  options.is_wanted = [](int class_id) { return class_id == 0; };
  const std::vector<Detection> found = network.detections(options);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FLOAT_EQ(found[0].box.x1, 30);
}

TEST(YoloDecoder, ReturnsTheBestUpToTheLimit) {
  Decoded network;
  for (int row = 0; row < anchors; ++row) {
    network.put(row, {float(row), 0, float(row) + 0.5F, 1}, 0.3F + 0.01F * float(row), 0);
  }
  const std::vector<Detection> found = network.detections(options_of(0.25F, 0.5F, 40));
  ASSERT_EQ(found.size(), 40U);
  EXPECT_FLOAT_EQ(found.back().box.x1, 2);
}

TEST(YoloDecoder, DropsRowsWithNonFiniteNumbers) {
  for (const float bad : {nan, infinity, -infinity}) {
    for (int i = 0; i < 11; ++i) {
      Decoded network;
      network.put(0, {0, 0, 20, 10}, 0.9F, 0.1F);
      network.put(1, {30, 0, 50, 10}, 0.8F, 0.1F);
      network.output.at<float>(0, i, 0) = bad;
      const std::vector<Detection> found = network.detections();
      // A score that is not the row's best does not matter, unless it becomes the best.
      const bool is_harmless = i == 5 && !(bad > 0);
      ASSERT_EQ(found.size(), is_harmless ? 2U : 1U) << bad << " in column " << i;
      EXPECT_FLOAT_EQ(found.back().score, 0.8F);
    }
  }
}

TEST(YoloDecoder, DropsBoxesWithoutArea) {
  Decoded network;
  network.put(0, {10, 0, 10, 10}, 0.9F, 0);
  network.put(1, {20, 10, 30, 5}, 0.9F, 0);
  EXPECT_TRUE(network.detections().empty());
}

TEST(YoloDecoder, RefusesOutputsWithoutAFiniteScore) {
  Decoded network;
  for (int row = 0; row < anchors; ++row) network.put(row, {0, 0, 1, 1}, nan, nan);
  expect_error<std::runtime_error>([&] { network.detections(); }, "none of its scores");
  std::mt19937 random(4);
  RawHeads heads = random_heads(random, 3);
  heads.classes = cv::Scalar(double{nan});
  expect_error<std::runtime_error>([&] { decoded(heads.outputs()); }, "none of its scores");
}

TEST(YoloDecoder, RefusesScoresOutsideZeroToOne) {
  Decoded network;
  network.put(0, {0, 0, 20, 10}, 3.5F, 0);
  expect_error<std::runtime_error>([&] { network.detections(); }, "score 3.5");
}

TEST(YoloDecoder, InfiniteLogitsGiveScoreOne) {
  std::mt19937 random(5);
  RawHeads heads = random_heads(random, 3, 0.5F);
  heads.classes.at<float>(0, 1, 17) = infinity;
  heads.classes.at<float>(0, 2, 4) = -infinity;
  const std::vector<Detection> found = decoded(heads.outputs(), options_of(0.9F, 0.5F, 300));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].class_id, 1);
  EXPECT_EQ(found[0].score, 1.0F);
}

// --- End-to-end ----------------------------------------------------------------------------------

TEST(YoloDecoder, ReadsEndToEndRowsSortedByScore) {
  cv::Mat rows = tensor({1, 6, 6 + prototype_count});
  const float values[6][6] = {{0, 0, 20, 10, 0.5F, 3}, {1, 0, 20, 10, 0.75F, 3},
                              {5, 5, 9, 9, 0.2F, 0},   {3, 3, 3, 8, 0.9F, 0},
                              {2, 1, 9, 8, 0.5F, 1},   {2, 1, 9, 8, nan, 1}};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) rows.at<float>(0, i, j) = values[i][j];
    rows.at<float>(0, i, 6) = float(i);
  }
  const std::vector<NamedTensor> outputs = {{"output0", rows},
                                            {"output1", tensor({1, prototype_count, 8, 16})}};
  EXPECT_EQ(bind_yolo(outputs, input).head, YoloHead::end_to_end);
  EXPECT_EQ(bind_yolo(outputs, input).class_count(), 0);
  const std::vector<Detection> found = decoded(outputs, options_of(0.25F, 0.5F, 300));
  ASSERT_EQ(found.size(), 3U);  // the network itself suppresses overlaps
  EXPECT_EQ(found[0].coefficients[0], 1);
  EXPECT_EQ(found[1].coefficients[0], 4);  // equal scores: the lower class first
  EXPECT_EQ(found[2].coefficients[0], 0);
  EXPECT_EQ(found[2].class_id, 3);
  EXPECT_FLOAT_EQ(found[2].box.x2, 20);
}

// --- Other outputs -------------------------------------------------------------------------------

TEST(YoloDecoder, RefusesOtherOutputs) {
  const NamedTensor prototypes{"p", tensor({1, prototype_count, 8, 16})};
  const auto refused = [&](const std::vector<NamedTensor>& outputs, const char* part) {
    expect_error<std::runtime_error>([&] { bind_yolo(outputs, input); }, part);
  };
  const auto table = [](int rows, int columns) {
    return NamedTensor{"t", tensor({1, rows, columns})};
  };
  refused({table(84, anchors)}, "no prototypes");
  refused({prototypes}, "one to three outputs");
  refused({table(64, anchors), prototypes, prototypes}, "two outputs");
  refused({table(4 + prototype_count, anchors), prototypes}, "can be the number of prototypes");
  refused({table(30, 300), prototypes}, "can be the number of prototypes");
  refused({table(64, anchors), table(7, anchors), table(5, anchors + 1), prototypes},
          "the number of anchors");
  refused({table(64, anchors), table(7, anchors), table(6, anchors), prototypes},
          "can be the number");
  refused({table(63, anchors), table(7, anchors), table(5, anchors), prototypes}, "missing");
  refused({table(64, anchors), table(5, anchors), prototypes}, "missing");
  refused({{"t", tensor({2, 84, anchors})}, prototypes}, "no batch of one");
  refused({{"t", tensor({1, 1, 1, 1, 1})}, prototypes}, "too many dimensions");
}

}  // namespace
}  // namespace dynfilter
