// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Depth that is out of step with the images of a host.

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/plugin.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

class PluginDepthOffset : public PluginTest {
 protected:
  // The thread sanitizer does not see how OpenCV's own threads wait for each other.
  PluginDepthOffset() { cv::setNumThreads(1); }
};

/// Draws a board that swings before a wall; `frame` counts frames.
cv::Mat shifted_board(int frame, int type, double inside, double outside) {
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
    plugin.submit(shifted_board(i, CV_8UC3, 200, 60), i / 30.0);
    plugin.filter(i / 30.0, shifted_board(i - late, CV_32FC1, 1, 3), keypoints, descriptors);
  }
  return plugin.counters();
}

TEST_F(PluginDepthOffset, CountsFramesByWhichDepthIsLate) {
  const std::string file = settings("dynfilter.missing_masks: \"keep\"\n");
  EXPECT_EQ(counters_with(file, 1).depth_checked, 60U);
  EXPECT_NEAR(counters_with(file, 1).depth_frames_late, 1, 0.1);
  EXPECT_NEAR(counters_with(file, 0).depth_frames_late, 0, 0.1);
}

TEST_F(PluginDepthOffset, ChecksDepthInAsManyFramesAsSet) {
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

/// Returns what the plugin says on standard error of 60 frames, from the first sentence on depth
/// on.
std::string said(const std::string& settings_file, int late) {
  ::testing::internal::CaptureStderr();
  counters_with(settings_file, late);
  const std::string all = ::testing::internal::GetCapturedStderr();
  const std::size_t depth = all.find("dynfilter: depth ");
  return depth == std::string::npos ? "" : all.substr(depth);
}

TEST_F(PluginDepthOffset, SaysOnceThatDepthIsOutOfStep) {
  const std::string keep = "dynfilter.missing_masks: \"keep\"\ndynfilter.start_features: 0\n";
  const std::string late = said(settings(keep), 1);
  const std::string want = "dynfilter: depth is late by ";
  EXPECT_EQ(late.find(want), 0U) << late;
  EXPECT_EQ(late.rfind(want), 0U) << late;
  EXPECT_NE(late.find("set dynfilter.depth_frames_late in " + file().string()), std::string::npos)
      << late;
  EXPECT_EQ(said(settings(keep), -1).find("dynfilter: depth is early by "), 0U);
  EXPECT_EQ(said(settings(keep), 0), "");
  EXPECT_EQ(said(settings(keep + "dynfilter.depth_frames_late: 1\n"), 1), "") << "it is known";
  EXPECT_EQ(said(settings(keep + "dynfilter.depth_check_frames: 0\n"), 1), "");
}

TEST_F(PluginDepthOffset, LabelsDoNotDependOnTheCheckOfDepth) {
  Plugin checked(settings()), unchecked(settings("dynfilter.depth_check_frames: 0\n"));
  for (int i = 0; i < frames; ++i) {
    HostFrame one(i), other(i);
    checked.submit(one.image, one.timestamp_s);
    unchecked.submit(other.image, other.timestamp_s);
    checked.filter(one.timestamp_s, one.depth, one.keypoints, one.descriptors);
    unchecked.filter(other.timestamp_s, other.depth, other.keypoints, other.descriptors);
    one.depth.setTo(0);  // the images are the host's again
    one.image.setTo(0);
    ASSERT_EQ(one.keypoints.size(), other.keypoints.size());
    EXPECT_LT(one.keypoints.size(), HostFrame(i).keypoints.size());
    for (std::size_t k = 0; k < one.keypoints.size(); ++k) {
      EXPECT_EQ(one.keypoints[k].class_id, other.keypoints[k].class_id);
    }
  }
  EXPECT_EQ(checked.counters().depth_checked, static_cast<std::size_t>(frames));
}

/// Person who walks 8 px a frame before a wall; both have texture, and depth is a frame late.
HostFrame walking(int index) {
  HostFrame frame(index);
  cv::RNG random(5);
  cv::Mat wall(image_size, CV_8UC3), person(80, 40, CV_8UC3);
  random.fill(wall, cv::RNG::UNIFORM, 0, 90);
  random.fill(person, cv::RNG::UNIFORM, 120, 250);
  cv::GaussianBlur(wall, wall, {7, 7}, 2);
  cv::GaussianBlur(person, person, {7, 7}, 2);
  person.copyTo(wall(cv::Rect(20 + 8 * index, 20, 40, 80)));
  frame.image = wall;
  frame.depth.setTo(3);
  frame.depth(cv::Rect(12 + 8 * index, 20, 40, 80)).setTo(1.5);
  Instance& instance = frame.segmentation.instances[0];
  instance.box = {15 + 8 * index, 15, 50, 90};
  instance.mask_origin = {20 + 8 * index, 20};
  return frame;
}

/// Filters as the plugin should: with depth moved along the flow.
FrameStatistics filtered_by_hand(int index) {
  HostFrame frame = walking(index);
  cv::Mat now, last, flow;
  cv::cvtColor(frame.image, now, cv::COLOR_BGR2GRAY);
  cv::cvtColor(walking(index - 1).image, last, cv::COLOR_BGR2GRAY);
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST)->calc(now, last, flow);
  FrameView view = frame.view(0);
  view.depth = moved_depth(frame.depth, flow, 1);
  return DynamicFilter().apply(view, frame.segmentation, frame.keypoints).statistics();
}

TEST_F(PluginDepthOffset, MovesLateDepthAlongTheOpticalFlow) {
  const std::filesystem::path moving_masks = path("moving_masks");
  MaskFolderWriter writer(moving_masks);
  for (int i = 0; i < 4; ++i) writer.add(walking(i).segmentation);
  writer.finish();
  const std::string masks_line = "dynfilter.mask_folder: \"" + moving_masks.string() + "\"\n";
  const auto compensated = [&](const std::string& lines) {
    Plugin plugin(raw_settings(masks_line + lines));
    std::vector<std::size_t> counts;
    for (int i = 0; i < 4; ++i) {
      HostFrame frame = walking(i);
      plugin.submit(frame.image, frame.timestamp_s);
      const cv::Mat before = frame.depth.clone();
      counts.push_back(
          plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors)
              .compensated);
      EXPECT_EQ(cv::norm(frame.depth, before, cv::NORM_INF), 0);
    }
    return counts;
  };
  const std::vector<std::size_t> moved = compensated("dynfilter.depth_frames_late: 1\n");
  const std::vector<std::size_t> as_given = compensated("");
  EXPECT_EQ(moved[0], as_given[0]);
  for (int i = 1; i < 4; ++i) {
    EXPECT_EQ(moved[static_cast<std::size_t>(i)], filtered_by_hand(i).compensated) << i;
    EXPECT_NE(moved[static_cast<std::size_t>(i)], as_given[static_cast<std::size_t>(i)]) << i;
  }
  // Two images of one time tell no motion.
  Plugin moving(raw_settings(masks_line + "dynfilter.depth_frames_late: 1\n"));
  Plugin other(raw_settings(masks_line));
  for (const int i : {1, 2}) {
    HostFrame one = walking(i), same = walking(i);
    one.timestamp_s = same.timestamp_s = walking(1).timestamp_s;
    moving.submit(one.image, one.timestamp_s);
    other.submit(same.image, same.timestamp_s);
    EXPECT_EQ(
        moving.filter(one.timestamp_s, one.depth, one.keypoints, one.descriptors).compensated,
        other.filter(same.timestamp_s, same.depth, same.keypoints, same.descriptors).compensated);
  }
  expect_error<std::runtime_error>([&] { Plugin(settings("dynfilter.depth_frames_late: 4\n")); },
                                   "dynfilter.depth_frames_late: got 4; want frames within ±3");
}

TEST_F(PluginDepthOffset, TakesDepthAsGivenWhereTheImageIsTooSmallForTheFlow) {
  Plugin plugin(settings("dynfilter.depth_frames_late: 1\ndynfilter.missing_masks: \"keep\"\n"));
  const cv::Mat strip(8, 640, CV_8UC3, cv::Scalar::all(90));
  for (int i = 0; i < 3; ++i) {
    std::vector<cv::KeyPoint> keypoints = {cv::KeyPoint(20, 4, 31)};
    cv::Mat descriptors(1, 32, CV_8UC1, cv::Scalar(0));
    plugin.submit(strip, i / 30.0);
    EXPECT_NO_THROW(plugin.filter(i / 30.0, cv::Mat1f(8, 640, 2.0F), keypoints, descriptors));
    EXPECT_EQ(keypoints.size(), 1U);
  }
}

TEST_F(PluginDepthOffset, RefusesToHoldImagesBack) {
  expect_error<std::runtime_error>([&] { Plugin(settings("dynfilter.depth_offset_s: 0.033\n")); },
                                   "dynfilter.depth_offset_s: got 0.033; want 0: the host hands");
  EXPECT_NO_THROW(Plugin(settings("dynfilter.depth_offset_s: 0\n")));
}

}  // namespace
}  // namespace dynfilter::testing
