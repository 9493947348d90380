// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Models and options that the segmenters refuse.

#include <opencv2/dnn.hpp>

#include "dynfilter/networks/network_segmenter.hpp"
#include "models.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

class BadModels : public Models {
 protected:
  /// Expects an error that names the file and its fault.
  static void expect_refused(const fs::path& file, const std::string& what) {
    SCOPED_TRACE(file);
    for (const std::string& part : {file.string() + ": ", what}) {
      expect_failure([&] { NetworkSegmenter{file}; }, part);
    }
  }
};

TEST_F(BadModels, AreRefusedByName) {
  expect_refused(folder() / "absent.onnx", "cannot be read");
  expect_refused(folder(), "cannot be read");
  expect_refused(model("bad_operator"), "Frobnicate");
  expect_refused(model("bad_inputs"), "has 2 inputs; want 1");
  expect_refused(model("bad_channels"), "its input images has the shape [1, 1, 8, 8]");
  expect_refused(model("bad_deformable"), "DCNv2");
  expect_refused(model("yolo_open_size"), "export it with a fixed size (dynamic=False)");
  expect_refused(model("bad_batch"), "[2, 3, 64, 64]; export it for one image (batch=1)");
  expect_refused(model("bad_mean"), "metadata mean is 123.7, 116.3, 103.5; want three numbers");
  expect_refused(model("external_absent"), "external_absent.weights, which is not there");
  expect_refused(model("external"), "external.weights; save the model as one file");
  expect_refused(model("bad_outputs"),
                 "is no known kind of network by its outputs, output0 [1, 3, 4, 16]. YOLACT: ");
  expect_refused(model("yolact_odd"),
                 "it has 344 priors; YOLACT has 258, YOLACT++ 774 for an input of 64x64");
  expect_refused(model("bad_yolox"), "output0 is YOLOX's");
  expect_refused(model("bad_outputs"), "Semantic: output0 is no image [1, C, rows, columns]");
}

TEST_F(BadModels, ClassIdsAreRefused) {
  cv::Mat image(64, 64, CV_8UC3, red);
  for (const bool has_background : {false, true}) {
    if (has_background) image.colRange(32, 64).setTo(0);
    expect_failure(
        [&] {
          NetworkSegmenter network(model("bad_argmax"));
          network.segment(frame_of(image));
        },
        "without ArgMax");
  }
}

TEST_F(BadModels, DevicesThatAreMissingAreNamed) {
  NetworkOptions options;
  options.device = "cuda";
  if (!cv::dnn::getAvailableTargets(cv::dnn::DNN_BACKEND_CUDA).empty()) {
    GTEST_SKIP() << "this OpenCV has CUDA, whose absence is tried here";
  }
  expect_failure([&] { NetworkSegmenter(model("yolo_raw"), options); },
                 "yolo_raw.onnx: cannot run on cuda: OpenCV ");
  options.device = "gpu";
  expect_misuse([&] { NetworkSegmenter(model("yolo_raw"), options); },
                "got the device \"gpu\"; want cpu, opencl, cuda or openvino");
}

TEST_F(BadModels, TruncatedModelsAreRefused) {
  const testing::TemporaryFolder place;
  const std::string whole = testing::file_text(model("yolo_raw"));
  for (std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{10}, whole.size() / 3,
                             whole.size() / 2, whole.size() - 1}) {
    const fs::path file = place.write("cut.onnx", whole.substr(0, length));
    expect_failure([&] { NetworkSegmenter{file}; }, "cut.onnx: ");
  }
  expect_refused(place.write("other.onnx", "no model"), "is truncated or no ONNX model");
  expect_refused(place.write("page.onnx", "<!DOCTYPE html>"), "is a web page");
}

TEST_F(BadModels, OptionsOutOfRangeAreRefused) {
  const auto refused = [](const NetworkOptions& options, const char* part) {
    expect_misuse([&] { NetworkSegmenter(model("yolo_raw"), options); }, part);
  };
  NetworkOptions options;
  options.score_threshold = 1.5F;
  refused(options, "score_threshold = 1.5");
  options = {};
  options.classes = {-1};
  refused(options, "class -1");
  options.classes = {0, 2};
  refused(options, "class 2 in classes; want 0 to 1");
  options = {};
  options.input_size = {640, 0};
  refused(options, "input_size 640x0");
  options.input_size = {0, 640};
  refused(options, "input_size 0x640");
  options.input_size = {16384, 16384};
  refused(options, "at most 16777216 pixels");
  options.input_size = {128, 64};
  expect_failure([&] { NetworkSegmenter(model("yolo_raw"), options); }, "has an input of 64x64");
}

}  // namespace
}  // namespace dynfilter::testing
