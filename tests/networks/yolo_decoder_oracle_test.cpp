// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Random outputs of networks in every layout, compared with a naive decoder.

#include "networks/yolo_decoder.hpp"

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "detection_checks.hpp"
#include "random_tensors.hpp"
#include "support/expect_error.hpp"
#include "yolo_heads.hpp"

namespace dynfilter::testing {
namespace {

using detail::bind_yolo;
using detail::Detection;
using detail::DetectionOptions;
using detail::NamedTensor;
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
