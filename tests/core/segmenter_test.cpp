// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenter.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace dynfilter {
namespace {

FrameView frame_of(const cv::Size& size) {
  FrameView frame;
  frame.id = 17;
  frame.timestamp_s = 2.5;
  frame.image = cv::Mat::zeros(size, CV_8UC3);
  return frame;
}

/// Returns the result that it was given.
class CannedSegmenter final : public Segmenter {
 public:
  explicit CannedSegmenter(Segmentation result) : result_(std::move(result)) {}

 private:
  Segmentation do_segment(const FrameView&) override { return result_; }
  Segmentation result_;
};

TEST(CallbackSegmenter, PassesTheImageOnAndStampsTheResult) {
  const FrameView frame = frame_of({4, 3});
  CallbackSegmenter segmenter([&](const cv::Mat& image) {
    EXPECT_EQ(image.data, frame.image.data);
    return std::vector{Instance::from_box({0, 0, 2, 2})};
  });
  const Segmentation result = segmenter.segment(frame);
  EXPECT_EQ(result.frame_id, 17U);
  EXPECT_EQ(result.timestamp_s, 2.5);
  EXPECT_EQ(result.image_size, cv::Size(4, 3));
  ASSERT_EQ(result.instances.size(), 1U);
  EXPECT_EQ(result.instances[0].box, cv::Rect(0, 0, 2, 2));
}

TEST(Segmenter, RefusesAResultOfAnotherSize) {
  Segmentation wrong;
  wrong.image_size = {3, 4};
  EXPECT_THROW(CannedSegmenter(wrong).segment(frame_of({4, 3})), std::invalid_argument);
}

TEST(Segmenter, RefusesMalformedInstances) {
  Segmentation wrong;
  wrong.image_size = {4, 3};
  wrong.instances.push_back(Instance::from_box({0, 0, 2, 2}));
  wrong.instances[0].mask = cv::Mat::zeros(2, 2, CV_32FC1);
  EXPECT_THROW(CannedSegmenter(wrong).segment(frame_of({4, 3})), std::invalid_argument);
}

TEST(Segmenter, TakesTheLargestImages) {
  for (const cv::Size& size :
       {cv::Size(1048576, 1), cv::Size(1, 1048576), cv::Size(32768, 32768)}) {
    EXPECT_NO_THROW(validate(Segmentation{0, 0, size, {}}, "a test")) << size;
  }
  for (const cv::Size& size :
       {cv::Size(1048577, 1), cv::Size(1, 1048577), cv::Size(32768, 32769)}) {
    EXPECT_THROW(validate(Segmentation{0, 0, size, {}}, "a test"), std::invalid_argument) << size;
  }
}

TEST(Segmenter, RefusesAFrameWithoutAnyImage) {
  CallbackSegmenter segmenter([](const cv::Mat&) { return std::vector<Instance>(); });
  EXPECT_THROW(segmenter.segment(FrameView()), std::invalid_argument);
}

}  // namespace
}  // namespace dynfilter
