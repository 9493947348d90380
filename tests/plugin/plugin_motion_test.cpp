// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The plugin's setting `motion`.

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/keep_static.hpp"
#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/plugin.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
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

/// People who walk, with masks of every third frame. Two tests share the frames.
const std::vector<SyntheticFrame>& walking_people() {
  static const std::vector<SyntheticFrame> rendered = [] {
    const SyntheticScene scene(scene_level("medium", 12));
    std::vector<SyntheticFrame> shots;
    for (int i = 0; i < 8; ++i) shots.push_back(scene.render(i));
    return shots;
  }();
  return rendered;
}

void write_every_third_mask(const std::filesystem::path& folder) {
  MaskFolderWriter writer(folder);
  for (std::size_t i = 0; i < 8; i += 3) writer.add(walking_people()[i].true_segmentation);
  writer.finish();
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
  Plugin with(settings(std::string("dynfilter.motion: 1\n") + camera_keys)), without(settings(""));
  const CameraParameters c = scene.camera();
  MotionFilter filter({c.fx, c.fy, c.cx, c.cy});
  FeatureLabels labels;
  Workspace workspace;
  std::size_t given_back = 0;
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
    without.filter(shot.frame.timestamp_s, shot.frame.depth, masked, no_descriptors);
    EXPECT_EQ(judged.size(), labels.statistics().kept());
    EXPECT_EQ(statistics.motion.outcome, labels.statistics().motion.outcome);
    EXPECT_EQ(statistics.motion.given_back, labels.statistics().motion.given_back);
    given_back += statistics.motion.given_back;
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
  EXPECT_GT(given_back, 50U);
}

/// With masks of every third frame.
TEST_F(PluginMotion, JudgesByMasksThatWereMoved) {
  const std::vector<SyntheticFrame>& rendered = walking_people();
  write_every_third_mask(folder_.path() / "masks");
  const CameraParameters c = SyntheticScene(scene_level("medium", 12)).camera();
  const std::string motion = "dynfilter.motion: 1\nCamera.fx: " + std::to_string(c.fx) +
                             "\nCamera.fy: " + std::to_string(c.fy) +
                             "\nCamera.cx: " + std::to_string(c.cx) +
                             "\nCamera.cy: " + std::to_string(c.cy) + "\n";
  Plugin plugin(
      settings("dynfilter.propagate: \"yes\"\ndynfilter.missing_masks: \"keep\"\n" + motion));
  MotionFilter filter({c.fx, c.fy, c.cx, c.cy});
  MaskPropagator propagator;
  FeatureLabels labels;
  Workspace workspace;
  std::size_t by_moved_masks = 0;
  for (std::size_t i = 0; i < rendered.size(); ++i) {
    FrameView frame = rendered[i].frame;
    frame.id = i + 1;
    std::vector<cv::KeyPoint> keypoints = corners_of(frame.image);
    const FeaturesView features(keypoints);
    std::optional<Segmentation> masks;
    if (i % 3 == 0) masks = rendered[i].true_segmentation;
    if (masks) masks->frame_id = frame.id;
    const auto moved = propagator.propagate(frame, masks);
    ASSERT_TRUE(moved);
    filter.apply(frame, moved, features, labels, workspace);
    const std::size_t masked = labels.statistics().masked;
    by_moved_masks += i % 3 == 0 ? 0 : masked;
    std::vector<cv::KeyPoint> expected = keypoints;
    keep_static(labels, expected);
    cv::Mat no_descriptors;
    plugin.submit(frame.image, frame.timestamp_s);
    const FrameStatistics statistics =
        plugin.filter(frame.timestamp_s, frame.depth, keypoints, no_descriptors);
    EXPECT_EQ(statistics.masked, masked) << i;
    ASSERT_EQ(keypoints.size(), expected.size()) << i;
    for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_EQ(keypoints[k].pt, expected[k].pt);
  }
  EXPECT_GT(by_moved_masks, 100U);
}

/// A host that makes two frames of each image.
TEST_F(PluginMotion, JudgesAsOftenWhereEachImageIsFilteredTwice) {
  write_every_third_mask(folder_.path() / "masks");
  const std::string file =
      settings(std::string("dynfilter.propagate: \"yes\"\ndynfilter.missing_masks: \"keep\"\n"
                           "dynfilter.motion: 1\n") +
               camera_keys);
  Plugin once(file), twice(file);
  for (const SyntheticFrame& rendered : walking_people()) {
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
  }
  EXPECT_EQ(twice.counters().never_submitted, 0U);
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
}

TEST_F(PluginMotion, NeedsThePinholeCameraOfTheHost) {
  using Bad = std::runtime_error;
  const std::string on = "dynfilter.motion: 1\n";
  expect_error<Bad>([&] { Plugin{settings(on)}; }, "dynfilter.motion");
  expect_error<Bad>([&] { Plugin{settings(on + "Camera1.fx: 500\n")}; }, "Camera1.fy above 0");
  expect_error<Bad>([&] { Plugin{settings(on + "Camera.fy: 500\n")}; }, "Camera.fx");
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
