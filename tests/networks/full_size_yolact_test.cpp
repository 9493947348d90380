// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// YOLACT and YOLACT++ of real size with random weights: they must load, run and decode. The test
// prints time and memory. Their detections are as random as their weights.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/networks/yolact_segmenter.hpp"
#include "models.hpp"
#include "networks/network.hpp"
#include "networks/yolact_decoder.hpp"

namespace dynfilter {
namespace {

/// Peak memory of the process in MB; 0 if the system does not report it.
long peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    long kilobytes = 0;
    if (word == "VmHWM:" && status >> kilobytes) return kilobytes / 1024;
  }
  return 0;
}

/// Measures wall-clock time, and processor time, which other programs do not disturb.
class Stopwatch {
 public:
  std::string text() const {
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start_;
    const double processor = static_cast<double>(std::clock() - processor_start_) / CLOCKS_PER_SEC;
    return std::to_string(wall.count()) + " s (" + std::to_string(processor) + " s of processors)";
  }

 private:
  std::clock_t processor_start_ = std::clock();
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

cv::Mat blobs_and_noise() {
  std::mt19937 random(1);
  cv::Mat image(480, 640, CV_8UC3);
  for (std::size_t i = 0; i < image.total() * 3; ++i) image.data[i] = std::uint8_t(random() & 63U);
  for (int i = 0; i < 30; ++i) {
    const auto number = [&](int limit) { return static_cast<int>(random() % unsigned(limit)); };
    cv::ellipse(image, {number(640), number(480)}, {10 + number(90), 10 + number(90)}, number(180),
                0, 360, cv::Scalar(number(255), number(255), number(255)), cv::FILLED);
  }
  return image;
}

class SlowFullSizeYolact : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    model_ = std::filesystem::path(DYNFILTER_FULL_SIZE_MODELS) / (GetParam() + ".onnx");
    if (!std::filesystem::exists(model_)) {
      GTEST_SKIP() << "no models: ctest makes them if python3-onnx is installed";
    }
  }

  std::filesystem::path model_;
};

TEST_P(SlowFullSizeYolact, LoadsRunsAndDecodes) {
  const bool is_plus = GetParam().find("plus") != std::string::npos;
  {
    detail::Network network(model_, {});
    const int shape[] = {1, 3, 550, 550};
    const std::vector<detail::NamedTensor> outputs =
        network.forward(cv::Mat(4, shape, CV_32F, cv::Scalar(0)));
    std::cout << detail::shapes_text(outputs) << '\n';
    const detail::YolactOutputs bound = detail::bind_yolact(outputs);
    EXPECT_EQ(bound.locations.rows, is_plus ? 57744 : 19248);
    EXPECT_EQ(bound.class_count(), 80);
    EXPECT_EQ(bound.prototypes.rows, 138);
    EXPECT_EQ(bound.prototypes.columns, 138);
    EXPECT_EQ(bound.prototypes.count, 32);
    EXPECT_TRUE(detail::are_probabilities(bound.confidences));
  }
  const Stopwatch loading;
  NetworkOptions options;
  options.score_threshold = 0.05F;
  const auto segmenter = make_network_segmenter(model_, options);
  std::cout << "loaded and run once in " << loading.text() << '\n';
  EXPECT_EQ(segmenter->class_names().at(0), "person");

  const cv::Mat image = blobs_and_noise();
  Segmentation found;
  for (int trial = 0; trial < 3; ++trial) {
    const Stopwatch frame;
    found = segmenter->segment(testing::frame_of(image));
    std::cout << "a frame in " << frame.text() << ", " << found.instances.size() << " instances\n";
  }
  std::cout << "peak memory " << peak_memory_mb() << " MB\n";
  EXPECT_GT(found.instances.size(), 0U);
  EXPECT_LE(found.instances.size(), 100U);
  const cv::Rect whole({0, 0}, image.size());
  for (std::size_t i = 0; i < found.instances.size(); ++i) {
    const Instance& instance = found.instances[i];
    EXPECT_EQ(instance.box & whole, instance.box);
    EXPECT_GT(cv::countNonZero(instance.mask), 0);
    const cv::Rect place(instance.mask_origin, instance.mask.size());
    EXPECT_EQ(place & whole, place);
    EXPECT_LE(instance.score, found.instances[i > 0 ? i - 1 : i].score);
  }
}

INSTANTIATE_TEST_SUITE_P(ResNet50, SlowFullSizeYolact,
                         ::testing::Values("yolact_resnet50", "yolact_plus_resnet50"),
                         [](const auto& chosen) { return chosen.param; });

}  // namespace
}  // namespace dynfilter
