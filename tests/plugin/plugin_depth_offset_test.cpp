// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Depth that is out of step with the images of a host.

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "dynfilter/plugin.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

/// Draws a board that swings before a wall; `frame` counts frames.
cv::Mat board(int frame, int type, double inside, double outside) {
  cv::Mat picture(image_size, type, cv::Scalar::all(outside));
  const int x = cvRound(50 + 30 * std::sin(0.06 * frame));
  cv::rectangle(picture, {x, 20, 50, 80}, cv::Scalar::all(inside), cv::FILLED);
  return picture;
}

/// Feeds 60 frames whose depth shows the scene `late` frames earlier.
PluginCounters counters_with(const std::string& settings_file, int late) {
  Plugin plugin(settings_file);
  for (int i = 0; i < 60; ++i) {
    std::vector<cv::KeyPoint> keypoints = {cv::KeyPoint(20, 20, 31)};
    cv::Mat descriptors(1, 32, CV_8UC1, cv::Scalar(0));
    plugin.submit(board(i, CV_8UC3, 200, 60), i / 30.0);
    plugin.filter(i / 30.0, board(i - late, CV_32FC1, 1, 3), keypoints, descriptors);
  }
  return plugin.counters();
}

TEST_F(PluginTest, CountsFramesByWhichDepthIsLate) {
  const std::string file = settings("dynfilter.missing_masks: \"keep\"\n");
  EXPECT_EQ(counters_with(file, 1).depth_checked, 60U);
  EXPECT_NEAR(counters_with(file, 1).depth_frames_late, 1, 0.1);
  EXPECT_NEAR(counters_with(file, 0).depth_frames_late, 0, 0.1);
}

TEST_F(PluginTest, ChecksDepthInAsManyFramesAsSet) {
  const PluginCounters few = counters_with(
      settings("dynfilter.missing_masks: \"keep\"\ndynfilter.depth_check_frames: 8\n"), 1);
  EXPECT_EQ(few.depth_checked, 8U);
  EXPECT_TRUE(std::isnan(few.depth_frames_late));
  EXPECT_EQ(counters_with(settings("dynfilter.missing_masks: \"keep\"\n"
                                   "dynfilter.depth_check_frames: 0\n"),
                          1)
                .depth_checked,
            0U);
}

TEST_F(PluginTest, RefusesToHoldImagesBack) {
  expect_error<std::runtime_error>([&] { Plugin(settings("dynfilter.depth_offset_s: 0.033\n")); },
                                   "dynfilter.depth_offset_s: got 0.033; want 0: the host hands");
  EXPECT_NO_THROW(Plugin(settings("dynfilter.depth_offset_s: 0\n")));
}

}  // namespace
}  // namespace dynfilter::testing
