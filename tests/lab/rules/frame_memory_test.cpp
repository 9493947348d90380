// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/rules/frames.hpp"

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

TEST(FrameMemory, TracksAndMeasuresTheMotion) {
  const Frames frames;
  peers::FrameMemory memory(camera);
  Workspace workspace;
  const FrameView first = frames.frame(0), second = frames.frame(1);
  EXPECT_TRUE(memory.next(frames.input(first), workspace).then.empty());
  const FilterInput input = frames.input(second);
  const peers::FramePair pair = memory.next(input, workspace);
  ASSERT_EQ(pair.tracks.size(), frames.features.size());
  std::size_t right = 0, of_wall = 0;
  for (std::size_t i = 0; i < frames.features.size(); ++i) {
    const cv::Point2f at = frames.features[i], expected = at - cv::Point2f(6, 0);
    if (frames.card_area.contains(at) || frames.card_area.contains(expected) || at.x > 300)
      continue;
    ++of_wall;
    right += pair.is_tracked(i) && cv::norm(pair.tracks[i].position - expected) < 0.2 ? 1 : 0;
  }
  EXPECT_GT(of_wall, 80U);
  EXPECT_GT(right, of_wall * 9 / 10);
  ASSERT_TRUE(pair.pose.has_value());
  // A shift and a turn look much alike before a flat wall; a point's place does not.
  const cv::Point3d place = *pair.pose * cv::Point3d(0, 0, 2);
  EXPECT_NEAR(camera.project(place)->x, 154, 0.3);
}

TEST(FrameMemory, StartsAnewAfterAGapAStepBackAnotherSizeAndWithoutImage) {
  const Frames frames;
  const auto knows_after = [&](auto change) {
    peers::FrameMemory memory(camera);
    Workspace workspace;
    FrameView first = frames.frame(0), second = frames.frame(1);
    change(second);
    memory.next(frames.input(first), workspace);
    return !memory.next(frames.input(second), workspace).then.empty();
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

TEST(FrameMemory, KeepsACopyOfTheImageThatTheHostOverwrites) {
  const Frames frames;
  peers::FrameMemory memory(camera);
  Workspace workspace;
  FrameView view = frames.frame(0);
  memory.next(frames.input(view), workspace);
  view.image.setTo(0);
  const FrameView second = frames.frame(1);
  const FilterInput input = frames.input(second);
  EXPECT_TRUE(same(memory.next(input, workspace).then, frames.frame(0).image));
}

TEST(FrameMemory, FeaturesOnMasksDoNotTellTheMotion) {
  Frames frames;
  frames.segmentation.image_size = {320, 240};
  const auto has_pose = [&](const cv::Rect& box, int class_id) {
    frames.segmentation.instances = {Instance::from_box(box, class_id)};
    peers::FrameMemory memory(camera);
    Workspace workspace;
    const FrameView first = frames.frame(0), second = frames.frame(1);
    memory.next(frames.input(first), workspace);
    return memory.next(frames.input(second), workspace).pose.has_value();
  };
  EXPECT_TRUE(has_pose({0, 0, 100, 240}, 0));
  EXPECT_FALSE(has_pose({0, 0, 320, 240}, 0));
  EXPECT_TRUE(has_pose({0, 0, 320, 240}, 1));
  EXPECT_FALSE(has_pose({0, 8, 312, 224}, 0)) << "8 px around the box";
}

}  // namespace
}  // namespace dynfilter::testing
