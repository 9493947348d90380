// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The plugin's setting `motion`.

#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/evaluation/scene_levels.hpp"
#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/plugin.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
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
  options.perfect_masks = true;
  return SyntheticScene(options);
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
  MotionState state;
  const CameraParameters c = scene.camera();
  const MotionFilter filter({c.fx, c.fy, c.cx, c.cy}, state);
  std::size_t given_back = 0;
  for (const SyntheticFrame& shot : rendered) {
    cv::Mat grey, no_descriptors;
    std::vector<cv::Point2f> corners;
    std::vector<cv::KeyPoint> keypoints;
    cv::cvtColor(shot.frame.image, grey, cv::COLOR_BGR2GRAY);
    cv::goodFeaturesToTrack(grey, corners, 500, 1e-3, 6);
    cv::KeyPoint::convert(corners, keypoints);
    const FeatureLabels labels = filter.apply(shot.frame, shot.true_segmentation, keypoints);
    std::vector<cv::KeyPoint> judged = keypoints, masked = keypoints;
    with.submit(shot.frame.image, shot.frame.timestamp_s);
    const FrameStatistics statistics =
        with.filter(shot.frame.timestamp_s, shot.frame.depth, judged, no_descriptors);
    without.filter(shot.frame.timestamp_s, shot.frame.depth, masked, no_descriptors);
    EXPECT_EQ(judged.size(), labels.statistics().kept());
    EXPECT_EQ(statistics.motion.outcome, labels.statistics().motion.outcome);
    EXPECT_EQ(statistics.motion.given_back, labels.statistics().motion.given_back);
    given_back += statistics.motion.given_back;
    EXPECT_GE(judged.size() + statistics.moving, masked.size());
  }
  EXPECT_GT(given_back, 50U);
}

TEST_F(PluginMotion, SaysThatItNeedsTheImage) {
  MaskFolderWriter writer(folder_.path() / "masks");
  writer.finish();
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
  expect_error<Bad>(
      [&] { Plugin{settings(on + "Camera.type: \"KannalaBrandt8\"\n" + camera_keys)}; },
      "a pinhole camera");
  expect_error<Bad>([&] { Plugin{settings("dynfilter.motion: 2\n")}; }, "dynfilter.motion");
}

}  // namespace
}  // namespace dynfilter::testing
