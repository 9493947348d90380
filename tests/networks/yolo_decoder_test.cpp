// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/yolo_decoder.hpp"

#include "detection_checks.hpp"
#include "random_tensors.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using detail::bind_yolo;
using detail::Box;
using detail::Detection;
using detail::DetectionOptions;
using detail::NamedTensor;
using detail::YoloHead;

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

  std::vector<detail::NamedTensor> outputs() const {
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

const DetectionOptions usual = options_of(0.5F, 0.5F, 300);

std::vector<Detection> decoded(const std::vector<NamedTensor>& outputs,
                               const DetectionOptions& options = usual) {
  return detail::decode_yolo(bind_yolo(outputs, input), options);
}

/// Decoded output of a network with two classes, at first without detections.
struct Decoded {
  cv::Mat output = tensor({1, 4 + 2 + prototype_count, anchors});
  cv::Mat prototypes = tensor({1, prototype_count, 8, 16});

  void put(int row, const Box& box, float first_class, float second_class) {
    const cv::Point2f first(box.x1, box.y1), last(box.x2, box.y2), middle = (first + last) / 2;
    const std::vector<float> columns[] = {{middle.x, middle.y, last.x - first.x, last.y - first.y},
                                          {first_class, second_class},
                                          {1, 2, 3, 4, 5}};
    int i = 0;
    for (const auto& part : columns) {
      for (const float value : part) output.at<float>(0, i++, row) = value;
    }
  }

  std::vector<Detection> detections(const DetectionOptions& options = options_of(0.25F, 0.5F,
                                                                                 300)) const {
    return decoded({{"output0", output}, {"output1", prototypes}}, options);
  }
};

TEST(YoloDecoder, RowsOfAnUnwantedBestClassAreDropped) {
  Decoded network;
  network.put(0, {0, 0, 20, 10}, 0.5F, 0.6F);
  network.put(1, {30, 0, 50, 10}, 0.5F, 0.4F);
  DetectionOptions options = options_of(0.25F, 0.5F, 300);
  options.classes = {0};
  const std::vector<Detection> found = network.detections(options);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FLOAT_EQ(found[0].box.x1, 30);
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

TEST(YoloDecoder, RefusesOutputsWithoutAFiniteScore) {
  Decoded network;
  for (int row = 0; row < anchors; ++row) network.put(row, {0, 0, 1, 1}, nan, nan);
  expect_failure([&] { network.detections(); }, "its weights may be damaged");
  std::mt19937 random(4);
  RawHeads heads = random_heads(random, 3);
  heads.classes = cv::Scalar(double{nan});
  expect_failure([&] { decoded(heads.outputs()); }, "none of its scores");
}

TEST(YoloDecoder, RefusesScoresOutsideZeroToOne) {
  Decoded network;
  network.put(0, {0, 0, 20, 10}, 3.5F, 0);
  expect_failure([&] { network.detections(); }, "score 3.5");
}

// --- Other outputs -------------------------------------------------------------------------------

TEST(YoloDecoder, RefusesOtherOutputs) {
  const NamedTensor prototypes{"p", tensor({1, prototype_count, 8, 16})};
  const auto refused = [&](const std::vector<NamedTensor>& outputs, const char* part) {
    expect_failure([&] { bind_yolo(outputs, input); }, part);
  };
  const auto table = [](int rows, int columns) {
    return NamedTensor{"t", tensor({1, rows, columns})};
  };
  refused({table(84, anchors + 1)}, "no prototypes [1, P, rows, columns], and t is no detector's");
  refused({table(64, anchors), table(7, anchors), table(7, anchors)}, "boxes and classes");
  refused({prototypes}, "one output, or boxes, classes and coefficients");
  refused({table(64, anchors), prototypes, prototypes}, "output p has too many dimensions");
  refused({table(4 + prototype_count, anchors), prototypes}, "can be the number of prototypes");
  refused({table(30, 300), prototypes}, "can be the number of prototypes");
  refused({table(64, anchors), table(7, anchors), table(5, anchors + 1), prototypes},
          "the number of anchors");
  refused({table(64, anchors), table(7, anchors), table(6, anchors), prototypes},
          "can be the number");
  refused({table(63, anchors), table(7, anchors), table(5, anchors), prototypes}, "missing");
  refused({table(64, anchors), table(5, anchors), prototypes}, "one output, or boxes");
  refused({{"t", tensor({2, 84, anchors})}, prototypes}, "no batch of one");
  refused({{"t", tensor({1, 1, 1, 1, 1})}, prototypes}, "too many dimensions");
}

// --- Random outputs in every layout, compared with a naive decoder -------------------------------

using detail::YoloOutputs;

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

TEST(YoloDecoder, MatchesANaiveDecoder) {
  std::mt19937 random(1);
  std::size_t found = 0;
  for (int trial = 0; trial < 40; ++trial) {
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
  EXPECT_GT(found, 200U);
}

TEST(YoloDecoder, ReadsEveryOutputLayout) {
  std::mt19937 random(2);
  const RawHeads heads = random_heads(random, 7);
  const std::vector<Detection> want = decoded(heads.outputs());
  ASSERT_GT(want.size(), 3U);
  const cv::Mat last = count_last(heads.prototypes);
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
    EXPECT_EQ(bound.prototypes.cells()(3, 37), heads.prototypes.at<float>(cv::Vec4i(0, 3, 2, 5)));
  }
}

TEST(YoloDecoder, ReadsDetectorsWithoutPrototypes) {
  std::mt19937 random(5);
  const RawHeads heads = random_heads(random, 7);
  std::vector<Detection> want = decoded(heads.outputs());
  ASSERT_GT(want.size(), 3U);
  for (Detection& one : want) one.coefficients.clear();
  const cv::Mat all = decoded_output(heads);
  cv::Mat boxes = all(std::vector<cv::Range>{{0, 1}, {0, 4 + 7}, {0, anchors}}).clone();
  const std::vector<std::vector<NamedTensor>> arrangements = {
      {{"o", boxes}},
      {{"o", turned(boxes)}},
      {{"b", heads.boxes}, {"s", heads.classes}},
      {{"s", turned(heads.classes)}, {"b", turned(heads.boxes)}},
  };
  for (const std::vector<NamedTensor>& outputs : arrangements) {
    SCOPED_TRACE(detail::shapes_text(outputs));
    expect_same(decoded(outputs), want);
    EXPECT_EQ(bind_yolo(outputs, input).prototypes.count, 0);
  }
  boxes.ptr<float>()[2] = -1;  // a centre beyond the image; in YOLOX's rows, a width
  EXPECT_EQ(bind_yolo({{"o", boxes}}, input).class_count(), 7);
}

TEST(YoloDecoder, BindsOutputsOfEqualShapeByOrder) {
  std::mt19937 random(3);
  RawHeads heads = random_heads(random, prototype_count);  // as many classes as prototypes
  const std::vector<Detection> want = picked(rows_of(heads), options_of(0.5F, 0.5F, 300));
  expect_same(decoded(heads.outputs()), want);

  heads = random_heads(random, 64);  // as many classes as columns of boxes
  const std::vector<Detection> others = picked(rows_of(heads), options_of(0.5F, 0.5F, 300));
  expect_same(decoded(heads.outputs()), others);
}

}  // namespace
}  // namespace dynfilter::testing
