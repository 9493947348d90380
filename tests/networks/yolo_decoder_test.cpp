// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/yolo_decoder.hpp"

#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "detection_checks.hpp"
#include "random_tensors.hpp"
#include "support/expect_error.hpp"
#include "yolo_heads.hpp"

namespace dynfilter::testing {
namespace {

using detail::bind_yolo;
using detail::Box;
using detail::Detection;
using detail::DetectionOptions;
using detail::NamedTensor;
using detail::YoloHead;

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
  expect_error<std::runtime_error>([&] { network.detections(); }, "its weights may be damaged");
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

}  // namespace
}  // namespace dynfilter::testing
