// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Depth out of step, hair, poor registration, and furniture within a hand of the persons.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "lab/scenes/scene_levels.hpp"
#include "support/expect_error.hpp"
#include "support/scene_images.hpp"

namespace dynfilter {
namespace {

using testing::painted;
using testing::same;

SyntheticSceneOptions small(const std::string& level) {
  SyntheticSceneOptions options = scene_level(level);
  options.image_size = {160, 120};
  return options;
}

SyntheticScene scene_with(const std::string& level,
                          const std::function<void(SyntheticSceneOptions&)>& change) {
  SyntheticSceneOptions options = small(level);
  change(options);
  return SyntheticScene(options);
}

/// Share of the pixels with depth in both images where they differ by more than 0.1 m.
double changed_share(const cv::Mat1w& a, const cv::Mat1w& b) {
  int both = 0, changed = 0;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      if (a(y, x) == 0 || b(y, x) == 0) continue;
      ++both;
      changed += std::abs(a(y, x) - b(y, x)) > 500 ? 1 : 0;
    }
  }
  return static_cast<double>(changed) / both;
}

TEST(DepthLate, ShowsTheSceneOfAnotherTimeFromItsOwnPlace) {
  // The camera moves as well, so a depth image from the place of another time differs everywhere
  // at edges.
  const auto brisk = [](double late_s) {
    return scene_with("medium", [&](SyntheticSceneOptions& o) {
      o.depth_late_s = late_s;
      o.depth_edge_shift_px = 0;
      o.person_speed_m_s = 2;
    });
  };
  const SyntheticScene in_step = brisk(0);
  for (const int frames : {3, -3, 1}) {
    const SyntheticScene late = brisk(frames / 30.0);
    const SyntheticFrame frame = late.render(20);
    const SyntheticFrame now = in_step.render(20);
    const SyntheticFrame then = in_step.render(20 - frames);
    const double to_then = changed_share(frame.frame.depth, then.frame.depth);
    const double to_now = changed_share(frame.frame.depth, now.frame.depth);
    EXPECT_LT(to_then, 0.005) << frames;
    EXPECT_GT(to_now, 4 * to_then) << frames;
    EXPECT_TRUE(same(frame.frame.image, now.frame.image));
    EXPECT_TRUE(same(frame.exact_depth_m, now.exact_depth_m));
    EXPECT_TRUE(same(painted(frame.poor_segmentation), painted(now.poor_segmentation)));
    EXPECT_TRUE(same(painted(frame.true_segmentation), painted(now.true_segmentation)));
    EXPECT_EQ(frame.pose.translation, now.pose.translation);
    EXPECT_DOUBLE_EQ(frame.frame.timestamp_s, now.frame.timestamp_s);
  }
}

TEST(DepthLate, LevelsHaveTheOffsetOfTheirName) {
  EXPECT_DOUBLE_EQ(scene_level("depth_late_33").depth_late_s, 1 / 30.0);
  EXPECT_DOUBLE_EQ(scene_level("depth_late_16").depth_late_s, 0.5 / 30);
  EXPECT_DOUBLE_EQ(scene_level("depth_early_33").depth_late_s, -1 / 30.0);
  EXPECT_DOUBLE_EQ(scene_level("depth_early_16").depth_late_s, -0.5 / 30);
}

TEST(DepthLate, CanBeLateInTheFirstFrame) {
  const SyntheticFrame first = SyntheticScene(small("depth_late_33")).render(0);
  EXPECT_GT(cv::countNonZero(first.frame.depth), 160 * 120 / 2);
}

TEST(HairWithoutDepth, LosesDepthOnThePersonsOnly) {
  const auto depth = [](double share) {
    return scene_with("medium",
                      [&](SyntheticSceneOptions& o) {
                        o.depth_edge_shift_px = 0;
                        o.hair_without_depth = share;
                      })
        .render(40);
  };
  const SyntheticFrame plain = depth(0);
  const SyntheticFrame half = depth(0.5);
  const SyntheticFrame bald = depth(1);
  const cv::Mat1b persons = painted(plain.true_segmentation);
  const auto lost = [&](const SyntheticFrame& frame) {
    const cv::Mat gone = (frame.frame.depth == 0) & (plain.frame.depth != 0);
    EXPECT_EQ(cv::countNonZero(gone & ~persons), 0);
    const cv::Mat kept = (frame.frame.depth == plain.frame.depth) | gone;
    EXPECT_EQ(cv::countNonZero(~kept), 0);
    return cv::countNonZero(gone);
  };
  EXPECT_EQ(lost(plain), 0);
  EXPECT_GT(lost(bald), 30);
  EXPECT_GT(lost(half), lost(bald) / 4);
  EXPECT_LT(lost(half), 3 * lost(bald) / 4);
}

TEST(DepthShift, MovesTheDepthImageToTheRight) {
  const auto depth = [](double shift_px) {
    return scene_with("medium",
                      [&](SyntheticSceneOptions& o) {
                        o.depth_edge_shift_px = 0;
                        o.depth_shift_px = shift_px;
                      })
        .render(40)
        .frame.depth;
  };
  const cv::Mat plain = depth(0);
  EXPECT_TRUE(same(depth(8).colRange(2, 160), plain.colRange(0, 158)));
  EXPECT_TRUE(same(depth(-8).colRange(0, 158), plain.colRange(2, 160)));
}

/// World's y of a pixel's point.
double world_y(const SyntheticFrame& frame, const CameraParameters& camera, int x, int y) {
  const double z = static_cast<double>(frame.exact_depth_m.at<float>(y, x));
  const cv::Vec3d point((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
  return (frame.pose.rotation * point + frame.pose.translation)[1];
}

TEST(Desk, LeavesThePersonsTheRoomThatTheyNeed) {
  const SyntheticScene scene(small("desk"));
  const SyntheticScene without =
      scene_with("desk", [](SyntheticSceneOptions& o) { o.persons = 0; });
  const CameraParameters camera = scene.camera();
  const double way = scene.options().person_distance_m;
  int close = 0;
  for (int i = 0; i < scene.size(); i += 15) {
    const SyntheticFrame frame = scene.render(i);
    const SyntheticFrame room = without.render(i);
    for (const Instance& person : frame.true_segmentation.instances) {
      for (int y = person.box.y; y < person.box.br().y; ++y) {
        for (int x = person.box.x; x < person.box.br().x; ++x) {
          const double static_y = world_y(room, camera, x, y);
          // Nothing static stands where a person may be.
          EXPECT_FALSE(static_y > way - 0.29 && static_y < way + 0.19) << i;
          const cv::Point in_mask = cv::Point(x, y) - person.mask_origin;
          const bool on_person = cv::Rect({0, 0}, person.mask.size()).contains(in_mask) &&
                                 person.mask.at<std::uint8_t>(in_mask) != 0;
          if (on_person) {
            EXPECT_GT(world_y(frame, camera, x, y), way - 0.26) << i;
            EXPECT_LT(world_y(frame, camera, x, y), way + 0.16) << i;
          } else {
            close += static_y > way - 0.45 && static_y < way + 0.45;
          }
        }
      }
    }
  }
  EXPECT_GT(close, 5000);  // pixels of furniture inside the boxes, at most 0.45 m away
}

TEST(TwoNear, ArePersonsOfTwoDepthsInOneDetection) {
  const SyntheticScene scene(small("two_near"));
  const CameraParameters camera = scene.camera();
  int joint = 0, frames = 0;
  std::vector<double> apart_m;  // of the visible surfaces, which depend on where the persons look
  for (int i = 0; i < scene.size(); i += 20) {
    const SyntheticFrame frame = scene.render(i);
    if (frame.true_segmentation.instances.size() < 2) continue;
    ++frames;
    joint += frame.poor_segmentation.instances.size() == 1;
    double sum[2] = {0, 0};
    int count[2] = {0, 0};
    for (const Instance& person : frame.true_segmentation.instances) {
      const auto which = static_cast<std::size_t>(*person.track_id);
      for (int y = 0; y < person.mask.rows; ++y) {
        for (int x = 0; x < person.mask.cols; ++x) {
          if (person.mask.at<std::uint8_t>(y, x) == 0) continue;
          sum[which] += world_y(frame, camera, x + person.mask_origin.x, y + person.mask_origin.y);
          ++count[which];
        }
      }
    }
    if (count[0] < 100 || count[1] < 100) continue;
    apart_m.push_back(sum[1] / count[1] - sum[0] / count[0]);
  }
  ASSERT_GT(apart_m.size(), 8U);
  std::sort(apart_m.begin(), apart_m.end());
  EXPECT_NEAR(apart_m[apart_m.size() / 2], 0.45, 0.05);
  EXPECT_GT(joint, 0.8 * frames);
}

TEST(SceneOptions, AreRefusedByNameIfOutOfRange) {
  const auto expect_named = [](const char* option,
                               const std::function<void(SyntheticSceneOptions&)>& spoil) {
    testing::expect_error<std::invalid_argument>([&] { scene_with("desk", spoil); },
                                                 std::string("got ") + option);
  };
  using Options = SyntheticSceneOptions;
  expect_named("depth_late_s = 0.3", [](Options& o) { o.depth_late_s = 0.3; });
  expect_named("depth_late_s", [](Options& o) { o.depth_late_s = -0.3; });
  expect_named("hair_without_depth", [](Options& o) { o.hair_without_depth = 1.1; });
  expect_named("depth_shift_px", [](Options& o) { o.depth_shift_px = -11; });
  expect_named("persons_spacing_m", [](Options& o) { o.persons_spacing_m = 1.1; });
  expect_named("persons_gap_m", [](Options& o) { o.persons_gap_m = -0.1; });
  expect_named("limb_swing, with a workplace,", [](Options& o) { o.limb_swing = 0.2; });
  expect_named("persons_sidestep, with a workplace,",
               [](Options& o) { o.persons_sidestep = false; });
  expect_named("person_distance_m, with a workplace,",
               [](Options& o) { o.person_distance_m = 1.5; });
}

}  // namespace
}  // namespace dynfilter
