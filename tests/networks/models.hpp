// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Models that make_models.py writes, and images for them.

#pragma once

#include "dynfilter/frame.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {

/// Fixture for tests that use the models, for example model("yolo_raw").
class Models : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder() / "yolo_raw.onnx")) {
      GTEST_SKIP() << "no models: ctest makes them if python3-onnx is installed";
    }
  }

  static std::filesystem::path folder() { return DYNFILTER_TEST_MODELS; }
  static std::filesystem::path model(const std::string& name) {
    return folder() / (name + ".onnx");
  }
};

constexpr int red_class = 0;
constexpr int blue_class = 1;
const cv::Scalar red(0, 0, 255), blue(255, 0, 0);

inline FrameView frame_of(const cv::Mat& image) {
  FrameView frame;
  frame.id = 5;
  frame.timestamp_s = 2.5;
  frame.image = image;
  return frame;
}

inline cv::Mat black_image(cv::Size size) { return {size, CV_8UC3, cv::Scalar::all(0)}; }

}  // namespace dynfilter::testing
