// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/rules/depth_consistency.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

const PinholeCamera camera{300, 300, 160, 120};

/// Frame k of a flat wall at 2 m that moves 6 px to the right a frame in the image, 0.04 m. A card
/// of 90x90 pixels before it stays where it is in the image.
struct Frames {
  std::vector<cv::Point2f> features;
  Segmentation segmentation;

  Frames() {
    for (int y = 24; y < 220; y += 12) {
      for (int x = 90; x < 310; x += 12) {
        features.emplace_back(static_cast<float>(x), static_cast<float>(y));
      }
    }
  }

  FrameView frame(int k) const {
    FrameView view;
    view.id = static_cast<std::uint64_t>(k);
    view.timestamp_s = 20 + 0.1 * k;
    const cv::Mat1b wall = texture({800, 240}, 1), card = texture({90, 90}, 2);
    view.image = wall(cv::Rect(300 - 6 * k, 0, 320, 240)).clone();
    card.copyTo(view.image(card_area));
    view.depth = cv::Mat(view.image.size(), CV_16UC1, cv::Scalar(10000));
    view.metres_per_unit = 1.0 / 5000;
    return view;
  }

  FilterInput input(const FrameView& view) const { return {view, segmentation, features}; }

  const cv::Rect card_area{130, 80, 90, 90};
};

TEST(CameraMotion, IsMeasured) {
  const Frames frames;
  peers::CameraMotion motion(camera);
  Workspace workspace;
  const FrameView first = frames.frame(0), second = frames.frame(1);
  EXPECT_FALSE(motion.next(frames.input(first), workspace).has_value());
  const auto pose = motion.next(frames.input(second), workspace);
  ASSERT_TRUE(pose.has_value());
  // A shift and a turn look much alike before a flat wall; a point's place does not.
  EXPECT_NEAR(camera.project(*pose * cv::Point3d(0, 0, 2))->x, 154, 0.3);
}

TEST(CameraMotion, StartsAnewAfterAGapAStepBackAnotherSizeAndWithoutImage) {
  const Frames frames;
  const auto knows_after = [&](auto change) {
    peers::CameraMotion motion(camera);
    Workspace workspace;
    FrameView first = frames.frame(0), second = frames.frame(1);
    change(second);
    motion.next(frames.input(first), workspace);
    return motion.next(frames.input(second), workspace).has_value();
  };
  EXPECT_TRUE(knows_after([](FrameView&) {}));
  EXPECT_FALSE(knows_after([](FrameView& view) { view.timestamp_s = 20.6; }));
  EXPECT_FALSE(knows_after([](FrameView& view) { view.timestamp_s = 20; }));
  EXPECT_FALSE(knows_after([](FrameView& view) { view.image = cv::Mat(); }));
  EXPECT_FALSE(knows_after([](FrameView& view) {
    view.image = view.image(cv::Rect(0, 0, 200, 200)).clone();
    view.depth = view.depth(cv::Rect(0, 0, 200, 200)).clone();
  }));
}

TEST(CameraMotion, KeepsACopyOfTheImageThatTheHostOverwrites) {
  const Frames frames;
  peers::CameraMotion motion(camera);
  Workspace workspace;
  FrameView view = frames.frame(0);
  motion.next(frames.input(view), workspace);
  view.image.setTo(0);
  EXPECT_TRUE(motion.next(frames.input(frames.frame(1)), workspace).has_value());
}

TEST(CameraMotion, FeaturesOnMasksDoNotTellIt) {
  Frames frames;
  frames.segmentation.image_size = {320, 240};
  const auto has_pose = [&](const cv::Rect& box, int class_id) {
    const cv::Mat mask(box.size(), CV_8UC1, cv::Scalar(1));
    frames.segmentation.instances = {Instance::from_box_mask(mask, box, class_id)};
    peers::CameraMotion motion(camera);
    Workspace workspace;
    const FrameView first = frames.frame(0), second = frames.frame(1);
    motion.next(frames.input(first), workspace);
    return motion.next(frames.input(second), workspace).has_value();
  };
  EXPECT_TRUE(has_pose({0, 0, 100, 240}, 0));
  EXPECT_FALSE(has_pose({0, 0, 320, 240}, 0));
  EXPECT_TRUE(has_pose({0, 0, 320, 240}, 1));
  EXPECT_FALSE(has_pose({0, 8, 312, 224}, 0)) << "8 px around the mask";
}

}  // namespace
}  // namespace dynfilter::testing
