// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Depth that is out of step with the images of a host.

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "dynfilter/plugin.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

class PluginDepthOffset : public PluginTest {};

/// Draws a board that swings before a wall; `frame` counts frames.
cv::Mat shifted_board(int frame, int type, double inside, double outside) {
  cv::Mat picture(image_size, type, cv::Scalar::all(outside));
  const int x = cvRound(50 + 30 * std::sin(0.06 * frame));
  cv::rectangle(picture, {x, 20, 50, 80}, cv::Scalar::all(inside), cv::FILLED);
  return picture;
}

/// Returns what the plugin says of depth on standard error in 60 frames, whose depth shows the
/// scene `late` frames earlier.
std::string said(const std::string& settings_file, int late) {
  ::testing::internal::CaptureStderr();
  Plugin plugin(settings_file);
  for (int i = 0; i < 60; ++i) {
    std::vector<cv::KeyPoint> keypoints = {cv::KeyPoint(20, 20, 31)};
    cv::Mat descriptors(1, 32, CV_8UC1, cv::Scalar(0));
    plugin.submit(shifted_board(i, CV_8UC3, 200, 60), i / 30.0);
    plugin.filter(i / 30.0, shifted_board(i - late, CV_32FC1, 1, 3), keypoints, descriptors);
  }
  std::istringstream lines(::testing::internal::GetCapturedStderr());
  std::string of_depth;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("dynfilter: depth ") == 0) of_depth += line;
  }
  return of_depth;
}

TEST_F(PluginDepthOffset, SaysOnceThatDepthIsOutOfStep) {
  const std::string file = settings("dynfilter.missing_masks: \"keep\"\n");
  const std::string late = said(file, 1), want = "dynfilter: depth is late by ";
  EXPECT_EQ(late.find(want), 0U) << late;
  EXPECT_EQ(late.rfind(want), 0U) << late;
  EXPECT_NE(late.find("pair the images anew"), std::string::npos) << late;
  EXPECT_EQ(said(file, -1).find("dynfilter: depth is early by "), 0U);
  EXPECT_EQ(said(file, 0), "");
}

}  // namespace
}  // namespace dynfilter::testing
