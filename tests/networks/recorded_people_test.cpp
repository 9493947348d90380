// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A real network on recorded frames of TUM fr3_walking_halfsphere, compared with masks that another
// program made with the same weights.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dynfilter/networks/network_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/test_data.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;

constexpr const char* sequence = "tum_fr3_walking_halfsphere_50";
constexpr int person = 0;

class SlowRecordedPeople : public testing::RecordedData {
 protected:
  void SetUp() override {
    RecordedData::SetUp();
    if (IsSkipped()) return;
    model_ = data(sequence).parent_path().parent_path() / "models" / "yolov8n-seg-raw-heads.onnx";
    if (!fs::exists(model_)) GTEST_SKIP() << "DYNFILTER_DATA_DIR has no " << model_;
  }

  fs::path model_;
};

cv::Mat people_in(const Segmentation& segmentation) {
  cv::Mat all(segmentation.image_size, CV_8UC1, cv::Scalar(0));
  for (const Instance& instance : segmentation.instances) {
    if (instance.class_id != person || instance.mask.empty()) continue;
    all(cv::Rect(instance.mask_origin, instance.mask.size())).setTo(255, instance.mask);
  }
  return all;
}

double intersection_over_union(const cv::Mat& a, const cv::Mat& b) {
  return cv::countNonZero(a & b) / static_cast<double>(std::max(cv::countNonZero(a | b), 1));
}

TEST_F(SlowRecordedPeople, MatchTheMasksOfAnotherProgram) {
  NetworkOptions options;
  options.classes = {person};
  NetworkSegmenter people(model_, options);
  EXPECT_EQ(people.class_names().at(person), "person");
  EXPECT_EQ(people.input_size(), cv::Size(640, 640));

  MaskFolderSegmenter theirs(data(sequence) / "masks");
  double sum = 0;
  double worst = 1;
  std::size_t frames = 0;
  for (const auto& entry : fs::directory_iterator(data(sequence) / "rgb")) {
    FrameView frame;
    frame.timestamp_s = std::stod(entry.path().stem());
    if (!theirs.has_mask(frame.timestamp_s)) continue;  // only 50 frames have masks
    frame.image = cv::imread(entry.path().string());
    const Segmentation found = people.segment(frame);
    EXPECT_FALSE(found.instances.empty()) << entry.path();
    const double iou = intersection_over_union(people_in(found), people_in(theirs.segment(frame)));
    sum += iou;
    worst = std::min(worst, iou);
    ++frames;
  }
  ASSERT_EQ(frames, 49U);
  std::cout << frames << " frames, mean IoU " << sum / static_cast<double>(frames) << ", worst "
            << worst << '\n';
  EXPECT_GE(sum / static_cast<double>(frames), 0.95);
}

}  // namespace
}  // namespace dynfilter
