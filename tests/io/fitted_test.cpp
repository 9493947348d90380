// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "io/image_file.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::detail {
namespace {

cv::Mat fit(cv::Size own, cv::Size size) {
  return fitted(cv::Mat(own, CV_8UC1, cv::Scalar(7)), size, "mask.png", "the frame");
}

TEST(Fitted, ResizesTheSameShape) {
  const cv::Mat small = (cv::Mat_<unsigned char>(2, 2) << 1, 2, 3, 4);
  const cv::Mat large = fitted(small, {6, 4}, "mask.png", "the frame");
  EXPECT_EQ(large.size(), cv::Size(6, 4));
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) EXPECT_EQ(large.at<unsigned char>(y, x), 1 + y / 2 * 2 + x / 3);
  }
  for (const auto& [own, size] : {std::pair(cv::Size(256, 192), cv::Size(1920, 1440)),
                                  {{640, 427}, {1280, 853}},
                                  {{620, 188}, {1241, 376}},
                                  {{1280, 960}, {640, 480}}}) {
    EXPECT_EQ(fit(own, size).size(), size);
    EXPECT_EQ(cv::countNonZero(fit(own, size) != 7), 0);
  }
}

TEST(Fitted, NamesWhatHasAnotherShape) {
  const auto refuses = [](cv::Size own, cv::Size size, const std::string& part) {
    testing::expect_error<std::runtime_error>([&] { fit(own, size); }, part);
  };
  refuses({640, 384}, {640, 360}, "mask.png: 640x384 pixels, but the frame has 640x360; is it a");
  refuses({640, 640}, {640, 480}, "retina_masks=True");
  refuses({448, 640}, {640, 427}, "retina_masks=True");
  refuses({192, 256}, {1920, 1440}, "turned by 90 degrees?");
  refuses({480, 640}, {640, 480}, "turned by 90 degrees?");
  refuses({639, 470}, {640, 480}, "639x470 pixels, but the frame has 640x480");
}

}  // namespace
}  // namespace dynfilter::detail
