// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The plugin's setting `motion`.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/keep_static.hpp"
#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/plugin.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

constexpr const char* camera_keys =
    "Camera.fx: 401.55\nCamera.fy: 404.4\nCamera.cx: 240.075\nCamera.cy: 185.7\n";

class PluginMotion : public ::testing::Test {
 protected:
  std::string settings(const std::string& more) {
    const auto file = folder_.path() / "host.yaml";
    std::ofstream(file) << "%YAML:1.0\n---\nDepthMapFactor: 5000\ndynfilter.mask_folder: \""
                        << (folder_.path() / "masks").string() << "\"\n"
                        << more;
    return file.string();
  }

  TemporaryFolder folder_;
};

SyntheticScene standing_people() {
  SyntheticSceneOptions options = scene_level("medium", 12);
  options.image_size = {480, 360};
  options.person_speed_m_s = 0;
  options.limb_swing = 0;
  options.mask_faults = MaskFaults::none;
  return SyntheticScene(options);
}

std::vector<cv::KeyPoint> corners_of(const cv::Mat& image) {
  cv::Mat grey;
  std::vector<cv::Point2f> corners;
  std::vector<cv::KeyPoint> keypoints;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::goodFeaturesToTrack(grey, corners, 500, 1e-3, 6);
  cv::KeyPoint::convert(corners, keypoints);
  return keypoints;
}

TEST_F(PluginMotion, DoesWhatTheFilterDoes) {
  const SyntheticScene scene = standing_people();
  constexpr int frames = 9;
  std::vector<SyntheticFrame> rendered;
  MaskFolderWriter writer(folder_.path() / "masks");
  for (int i = 0; i < frames; ++i) {
    rendered.push_back(scene.render(i));
    writer.add(rendered.back().true_segmentation);
  }
  writer.finish();
  Plugin with(settings(camera_keys));
  Plugin without(settings(std::string("dynfilter.motion: 0\n") + camera_keys));
  MotionFilter filter(scene.camera());
  FeatureLabels labels;
  Workspace workspace;
  std::size_t kept_still = 0;
  for (const SyntheticFrame& shot : rendered) {
    cv::Mat no_descriptors;
    const std::vector<cv::KeyPoint> keypoints = corners_of(shot.frame.image);
    filter.apply(shot.frame, shot.true_segmentation, keypoints, labels, workspace);
    std::vector<cv::KeyPoint> judged = keypoints, masked = keypoints;
    with.submit(shot.frame.image, shot.frame.timestamp_s);
    const FrameStatistics statistics =
        with.filter(shot.frame.timestamp_s, shot.frame.depth, judged, no_descriptors);
    std::vector<cv::KeyPoint> again = keypoints;
    EXPECT_EQ(
        with.filter(shot.frame.timestamp_s, shot.frame.depth, again, no_descriptors).motion.outcome,
        statistics.motion.outcome);
    EXPECT_EQ(again.size(), judged.size());
    without.submit(shot.frame.image, shot.frame.timestamp_s);
    EXPECT_EQ(without.filter(shot.frame.timestamp_s, shot.frame.depth, masked, no_descriptors)
                  .motion.outcome,
              MotionOutcome::not_run);
    EXPECT_EQ(judged.size(), labels.statistics().kept());
    EXPECT_EQ(statistics.motion.outcome, labels.statistics().motion.outcome);
    EXPECT_EQ(statistics.motion.kept_still, labels.statistics().motion.kept_still);
    kept_still += statistics.motion.kept_still;
    std::vector<cv::KeyPoint> expected = keypoints;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      expected[i].class_id = labels[i].reason == Reason::still ? 0 : -1;  // 0: a person
    }
    keep_static(labels, expected);
    ASSERT_EQ(judged.size(), expected.size());
    for (std::size_t i = 0; i < judged.size(); ++i) {
      EXPECT_EQ(judged[i].class_id, expected[i].class_id) << i;
    }
    EXPECT_GE(judged.size() + statistics.moving, masked.size());
  }
  EXPECT_GT(kept_still, 50U);
}

/// Who stands still is marked again, though another frame failed and the mask shows nobody now.
TEST_F(PluginMotion, MarksStillFeaturesOfAFrameThatIsFilteredAgain) {
  const SyntheticScene scene = standing_people();
  std::vector<SyntheticFrame> shots;
  MaskFolderWriter writer(folder_.path() / "masks");
  for (int i = 0; i < 9; ++i) {
    shots.push_back(scene.render(i));
    writer.add(shots.back().true_segmentation);
  }
  writer.finish();
  std::filesystem::remove(folder_.path() / "masks/instances.csv");
  Plugin plugin(settings(camera_keys));
  const auto marks = [&](const SyntheticFrame& shot, double time_s) {
    std::vector<cv::KeyPoint> keypoints = corners_of(shot.frame.image);
    cv::Mat no_descriptors;
    plugin.filter(time_s, shot.frame.depth, keypoints, no_descriptors);
    std::vector<int> ids;
    for (const cv::KeyPoint& keypoint : keypoints) ids.push_back(keypoint.class_id);
    return ids;
  };
  std::vector<int> ids;
  for (const SyntheticFrame& shot : shots) {
    plugin.submit(shot.frame.image, shot.frame.timestamp_s);
    ids = marks(shot, shot.frame.timestamp_s);
  }
  EXPECT_GT(std::count(ids.begin(), ids.end(), 0), 0);
  for (const auto& mask : std::filesystem::directory_iterator(folder_.path() / "masks")) {
    if (mask.path().extension() == ".png") {
      cv::imwrite(mask.path().string(), cv::Mat1b::zeros(scene.options().image_size));
    }
  }
  expect_error<std::runtime_error>([&] { marks(shots.back(), 1e5); }, "there is no such mask");
  EXPECT_EQ(marks(shots.back(), shots.back().frame.timestamp_s), ids);
}

/// A host that makes two frames of each image, and a third of some of its features; masks of every
/// third one are moved.
TEST_F(PluginMotion, JudgesAsOftenWhereEachImageIsFilteredTwice) {
  const SyntheticScene scene(scene_level("medium", 12));
  MaskFolderWriter writer(folder_.path() / "masks");
  std::vector<SyntheticFrame> shots;
  for (int i = 0; i < 8; ++i) {
    shots.push_back(scene.render(i));
    if (i % 3 == 0) writer.add(shots.back().true_segmentation);
  }
  writer.finish();
  const std::string file =
      settings(std::string("dynfilter.propagate: \"yes\"\ndynfilter.missing_masks: \"keep\"\n") +
               camera_keys);
  Plugin once(file), twice(file);
  for (const SyntheticFrame& rendered : shots) {
    const double time_s = rendered.frame.timestamp_s;
    once.submit(rendered.frame.image, time_s);
    twice.submit(rendered.frame.image, time_s);
    std::vector<std::vector<cv::KeyPoint>> left(3, corners_of(rendered.frame.image));
    std::vector<MotionOutcome> outcomes;
    for (std::size_t i = 0; i < left.size(); ++i) {
      cv::Mat no_descriptors;
      Plugin& plugin = i == 0 ? once : twice;
      outcomes.push_back(
          plugin.filter(time_s, rendered.frame.depth, left[i], no_descriptors).motion.outcome);
      EXPECT_EQ(outcomes[i], outcomes[0]);
      EXPECT_EQ(left[i].size(), left[0].size());
    }
    std::vector<cv::KeyPoint> some = corners_of(rendered.frame.image);
    some.resize(some.size() / 2);
    cv::Mat no_descriptors;
    EXPECT_EQ(twice.filter(time_s, rendered.frame.depth, some, no_descriptors).motion.outcome,
              MotionOutcome::not_run);
  }
  EXPECT_EQ(twice.counters().never_submitted, 0U);
  const SyntheticFrame& last = shots.back();
  std::vector<cv::KeyPoint> corners = corners_of(last.frame.image);
  cv::Mat no_descriptors;
  once.reset();
  once.submit(last.frame.image, last.frame.timestamp_s + 0.03);
  EXPECT_EQ(once.filter(last.frame.timestamp_s + 0.03, last.frame.depth, corners, no_descriptors)
                .motion.outcome,
            MotionOutcome::started);
}

TEST_F(PluginMotion, SaysThatItNeedsTheImage) {
  std::filesystem::create_directories(folder_.path() / "masks");
  Plugin plugin(settings(std::string("dynfilter.motion: 1\ndynfilter.missing_masks: \"keep\"\n") +
                         camera_keys));
  std::vector<cv::KeyPoint> keypoints(3, cv::KeyPoint(5, 5, 1));
  cv::Mat descriptors;
  const FrameStatistics statistics =
      plugin.filter(1, cv::Mat1f(40, 40, 1.0F), keypoints, descriptors);
  EXPECT_EQ(statistics.motion.outcome, MotionOutcome::no_image);
  EXPECT_EQ(keypoints.size(), 3U);
  ::testing::internal::CaptureStderr();
  for (int i = 2; i < 40; ++i) plugin.filter(i, keypoints, descriptors);
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("It needs a depth image with each frame"), std::string::npos) << said;
}

TEST_F(PluginMotion, IsOffWhereItCannotBeUnlessAskedFor) {
  std::filesystem::create_directories(folder_.path() / "masks");
  const auto outcome = [&](const std::string& more) {
    Plugin plugin(settings("dynfilter.missing_masks: \"keep\"\n" + more));
    plugin.submit(cv::Mat3b(40, 40), 1);
    std::vector<cv::KeyPoint> keypoints(3, cv::KeyPoint(5, 5, 1));
    cv::Mat descriptors;
    return plugin.filter(1, cv::Mat1f(40, 40, 1.0F), keypoints, descriptors).motion.outcome;
  };
  EXPECT_EQ(outcome(camera_keys), MotionOutcome::started);
  EXPECT_EQ(outcome(""), MotionOutcome::not_run);
  EXPECT_EQ(outcome(std::string("Camera.k4: 0.1\n") + camera_keys), MotionOutcome::not_run);
  EXPECT_EQ(outcome(std::string("Camera.type: \"KannalaBrandt8\"\n") + camera_keys),
            MotionOutcome::not_run);
  for (const char* rule : {"dynfilter.rule: \"mask\"\n", "dynfilter.rule: \"paper\"\n"}) {
    EXPECT_EQ(outcome(std::string(rule) + camera_keys), MotionOutcome::not_run);
    EXPECT_EQ(outcome(std::string(rule) + "dynfilter.motion: 1\n" + camera_keys),
              MotionOutcome::started);
  }
}

TEST_F(PluginMotion, NeedsThePinholeCameraOfTheHost) {
  using Bad = std::runtime_error;
  const std::string on = "dynfilter.motion: 1\n";
  expect_error<Bad>([&] { Plugin{settings(on)}; }, "dynfilter.motion");
  expect_error<Bad>([&] { Plugin{settings(on + "Camera1.fx: 500\n")}; }, "Camera1.fy above 0");
  expect_error<Bad>([&] { Plugin{settings(on + "Camera.fy: 500\n")}; }, "Camera.fx");
  for (const char* focal : {"Camera.fx: 0\nCamera.fy: 500\n", "Camera.fx: 500\nCamera.fy: 0\n"}) {
    expect_error<Bad>([&] { Plugin{settings(on + focal + "Camera.cx: 1\nCamera.cy: 1\n")}; },
                      "Camera.fy above 0");
  }
  expect_error<Bad>(
      [&] { Plugin{settings(on + "Camera.fx: 500\nCamera.fy: 500\nCamera.cx: 1\n")}; },
      "Camera.cx and Camera.cy; want the host's camera");
  expect_error<Bad>(
      [&] { Plugin{settings(on + "Camera.type: \"KannalaBrandt8\"\n" + camera_keys)}; },
      "a pinhole camera");
  expect_error<Bad>([&] { Plugin{settings("dynfilter.motion: 2\n")}; }, "dynfilter.motion");
}

}  // namespace
}  // namespace dynfilter::testing
