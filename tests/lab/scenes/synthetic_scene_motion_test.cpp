// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The levels about motion, and the truth about what moves in a frame.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "lab/scenes/scene_levels.hpp"
#include "support/expect_error.hpp"
#include "support/scene_images.hpp"

namespace dynfilter {
namespace {

using testing::painted;
using testing::pixel_hash;
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

/// Mask of one person on the whole image.
cv::Mat1b mask_of(const Segmentation& segmentation, int person) {
  Segmentation one = segmentation;
  one.instances.clear();
  for (const Instance& instance : segmentation.instances) {
    if (instance.track_id == person) one.instances.push_back(instance);
  }
  return painted(one);
}

/// Share of a person's pixels that move; -1 if hardly any is visible.
double moving_share(const SyntheticFrame& frame, int person) {
  const cv::Mat1b mask = mask_of(frame.true_segmentation, person);
  if (cv::countNonZero(mask) < 100) return -1;
  return static_cast<double>(cv::countNonZero(mask & frame.moving_mask)) / cv::countNonZero(mask);
}

TEST(Motion, SittingPersonNeverMovesAndTheOtherOneDoes) {
  const SyntheticScene scene(small("sitting"));
  std::vector<double> walking;
  for (int i = 0; i < scene.size(); i += 20) {
    const SyntheticFrame frame = scene.render(i);
    EXPECT_EQ(frame.moving_mask.type(), CV_8UC1);
    EXPECT_EQ(moving_share(frame, 0), 0) << i;
    walking.push_back(moving_share(frame, 1));
    const cv::Mat elsewhere = frame.moving_mask & ~painted(frame.true_segmentation);
    EXPECT_EQ(cv::countNonZero(elsewhere), 0) << i;
  }
  std::sort(walking.begin(), walking.end());
  EXPECT_GT(walking[walking.size() / 2], 0.95);
  EXPECT_EQ(scene.render(0).true_segmentation.instances[0].box.height > 0, true);
}

TEST(Motion, PersonsStopAndGo) {
  const SyntheticScene scene(small("stop_and_go"));
  int standing = 0, walking = 0;
  for (int i = 0; i < scene.size(); i += 10) {
    const SyntheticFrame frame = scene.render(i);
    for (const int person : {0, 1}) {
      const double share = moving_share(frame, person);
      standing += share == 0 ? 1 : 0;
      walking += share > 0.9 ? 1 : 0;
    }
  }
  EXPECT_GT(standing, 15);  // of 60, each half of the time
  EXPECT_GT(walking, 15);
  EXPECT_LT(standing + walking, 61);
}

TEST(Motion, NobodyMovesAtNoSpeed) {
  const SyntheticScene scene =
      scene_with("medium", [](SyntheticSceneOptions& o) { o.person_speed_m_s = 0; });
  EXPECT_EQ(cv::countNonZero(scene.render(30).moving_mask), 0);
  EXPECT_EQ(cv::countNonZero(SyntheticScene(small("static")).render(30).moving_mask), 0);
}

TEST(Motion, MovingPixelsAreThoseOfTheCart) {
  const SyntheticScene with_cart(small("pushed"));
  const SyntheticScene without =
      scene_with("pushed", [](SyntheticSceneOptions& o) { o.moving_box = MovingBox::none; });
  for (const int i : {3, 40, 77, 150}) {
    const SyntheticFrame frame = with_cart.render(i);
    const cv::Mat nearer = frame.exact_depth_m < without.render(i).exact_depth_m;
    EXPECT_GT(cv::countNonZero(nearer), 500);
    EXPECT_TRUE(same(frame.moving_mask, nearer)) << i;
    EXPECT_TRUE(frame.true_segmentation.instances.empty());
    EXPECT_TRUE(frame.poor_segmentation.instances.empty());
  }
  const SyntheticScene parked =
      scene_with("pushed", [](SyntheticSceneOptions& o) { o.box_speed_m_s = 0; });
  EXPECT_EQ(cv::countNonZero(parked.render(40).moving_mask), 0);
}

/// World's x of the middle of the moving surface.
double moving_x(const SyntheticScene& scene, int index) {
  const SyntheticFrame frame = scene.render(index);
  const CameraParameters camera = scene.camera();
  double low = 1e9, high = -1e9;
  for (int y = 0; y < frame.moving_mask.rows; ++y) {
    for (int x = 0; x < frame.moving_mask.cols; ++x) {
      if (frame.moving_mask.at<std::uint8_t>(y, x) == 0) continue;
      const double z = static_cast<double>(frame.exact_depth_m.at<float>(y, x));
      const cv::Vec3d point((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
      const double at = (frame.pose.rotation * point + frame.pose.translation)[0];
      low = std::min(low, at);
      high = std::max(high, at);
    }
  }
  return (low + high) / 2;
}

TEST(Motion, CartHasTheSpeedOfItsLevel) {
  for (const auto& [level, speed] :
       std::vector<std::pair<std::string, double>>{{"pushed", 0.3}, {"pushed_slow", 0.08}}) {
    const SyntheticScene scene(small(level));
    std::vector<double> speeds;
    for (int i = 5; i + 30 < scene.size(); i += 30) {
      speeds.push_back(std::abs(moving_x(scene, i + 15) - moving_x(scene, i)) / 0.5);
    }
    std::sort(speeds.begin(), speeds.end());
    // The cart slows down to turn; the median is on the way.
    EXPECT_NEAR(speeds[speeds.size() / 2], speed, 0.15 * speed) << level;
  }
}

double contrast_of_moving(const std::string& level) {
  const SyntheticFrame frame = SyntheticScene(small(level)).render(40);
  cv::Scalar mean, deviation;
  cv::meanStdDev(frame.frame.image, mean, deviation, frame.moving_mask);
  return deviation[1];
}

TEST(Motion, PlainBoxHasHardlyAnyTexture) {
  EXPECT_LT(contrast_of_moving("pushed_plain"), 0.5 * contrast_of_moving("pushed"));
}

TEST(Motion, CarriedBoxMovesWithItsPersonAndIsInNoMask) {
  const SyntheticScene scene(small("carried"));
  int boxes = 0;
  for (int i = 0; i < scene.size(); i += 20) {
    const SyntheticFrame frame = scene.render(i);
    EXPECT_LE(frame.true_segmentation.instances.size(), 1U);
    const cv::Mat box = frame.moving_mask & ~painted(frame.true_segmentation);
    boxes += cv::countNonZero(box) > 200 ? 1 : 0;
  }
  EXPECT_GT(boxes, 10);  // of 15; sometimes it is behind the back or stands
}

TEST(Motion, CameraRestsTurnsOrHurries) {
  const SyntheticScene still(small("still_camera"));
  const SyntheticScene rotation(small("rotation"));
  const SyntheticScene fast(small("fast"));
  double slow_m = 0, fast_m = 0;
  const SyntheticScene slow =
      scene_with("fast", [](SyntheticSceneOptions& o) { o.camera_rate = 1; });
  for (int i = 1; i < still.size(); ++i) {
    EXPECT_EQ(still.pose(i).translation, still.pose(0).translation);
    EXPECT_EQ(still.pose(i).rotation, still.pose(0).rotation);
    EXPECT_EQ(rotation.pose(i).translation, rotation.pose(0).translation);
    EXPECT_NE(rotation.pose(i).rotation, rotation.pose(i - 1).rotation);
    slow_m += cv::norm(slow.pose(i).translation - slow.pose(i - 1).translation);
    fast_m += cv::norm(fast.pose(i).translation - fast.pose(i - 1).translation);
  }
  EXPECT_NEAR(fast_m / slow_m, 3, 0.3);
}

TEST(Motion, ShiftedCameraRendersTheRightImageOfAPair) {
  const double baseline_m = 0.1;
  const SyntheticScene left(small("medium"));
  const SyntheticScene right =
      scene_with("medium", [&](SyntheticSceneOptions& o) { o.camera_shift_m = baseline_m; });
  const SyntheticFrame seen = left.render(20), shifted = right.render(20);
  EXPECT_EQ(shifted.pose.rotation, seen.pose.rotation);
  const cv::Vec3d moved =
      seen.pose.rotation.t() * (shifted.pose.translation - seen.pose.translation);
  EXPECT_LT(cv::norm(moved - cv::Vec3d(baseline_m, 0, 0)), 1e-12);
  int all = 0, same_surface = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 20; x < 160; ++x) {  // pixels that both cameras see
      const float depth_m = seen.exact_depth_m.at<float>(y, x);
      const int right_x = cvRound(x - left.camera().fx * baseline_m / double{depth_m});
      const float at_right_m = shifted.exact_depth_m.at<float>(y, right_x);
      ++all;
      same_surface += std::abs(at_right_m - depth_m) < 0.02F * depth_m ? 1 : 0;
    }
  }
  EXPECT_GT(same_surface, 0.85 * all) << "the rest is hidden from one of them";
}

TEST(Camera, FocalLengthSetsTheFieldOfView) {
  const auto camera = [](cv::Size size) {
    return scene_with("medium", [&](SyntheticSceneOptions& o) {
      o.image_size = size;
      o.focal_px = 90;
    });
  };
  const SyntheticScene wide = camera({180, 60}), narrow = camera({80, 40});
  EXPECT_EQ(wide.camera().fx, 90);
  EXPECT_EQ(wide.camera().fy, 90);
  EXPECT_EQ(wide.camera().cx, 89.5);
  EXPECT_EQ(wide.camera().cy, 29.5);
  const cv::Mat middle = wide.render(20).exact_depth_m(cv::Rect(50, 10, 80, 40));
  EXPECT_TRUE(same(middle, narrow.render(20).exact_depth_m)) << "the same rays";
}

TEST(Motion, CrowdCoversMostOfTheImage) {
  const SyntheticScene scene(small("crowd"));
  double share = 0;
  for (int i = 0; i < scene.size(); i += 30) {
    share += cv::countNonZero(painted(scene.render(i).true_segmentation)) / (10.0 * 160 * 120);
  }
  EXPECT_NEAR(share, 0.60, 0.04);
}

TEST(Motion, LightChangesOnlyTheImage) {
  const SyntheticScene changing(small("sitting"));
  const SyntheticScene steady = scene_with("sitting", [](SyntheticSceneOptions& o) {
    o.light_drift = 0;
    o.reflection = 0;
  });
  const SyntheticFrame a = changing.render(20);
  const SyntheticFrame b = steady.render(20);
  EXPECT_TRUE(same(a.frame.depth, b.frame.depth));
  EXPECT_TRUE(same(painted(a.poor_segmentation), painted(b.poor_segmentation)));
  EXPECT_TRUE(same(a.moving_mask, b.moving_mask));
  const double change = cv::norm(a.frame.image, b.frame.image, cv::NORM_L1) / (3 * 160 * 120);
  EXPECT_GT(change, 4);
  EXPECT_LT(change, 30);
}

TEST(DepthLateSuffix, MakesDepthOneFrameOlderInEveryLevel) {
  for (const char* name : {"pushed", "crowd", "medium"}) {
    const SyntheticSceneOptions late = scene_level(std::string(name) + "_depth_late", 5);
    const SyntheticSceneOptions in_step = scene_level(name, 5);
    EXPECT_DOUBLE_EQ(late.depth_late_s, 1 / 30.0) << name;
    EXPECT_EQ(late.seed, 5U);
    EXPECT_EQ(late.persons, in_step.persons);
    EXPECT_EQ(late.moving_box, in_step.moving_box);
    EXPECT_EQ(in_step.depth_late_s, 0);
  }
  for (const char* name : {"_depth_late", "nothing_depth_late", "medium_depth_late_depth_late"}) {
    EXPECT_THROW(scene_level(name), std::invalid_argument) << name;
  }
}

TEST(Motion, OptionsAreRefusedByNameIfOutOfRange) {
  const auto expect_named = [](const char* option,
                               const std::function<void(SyntheticSceneOptions&)>& spoil) {
    testing::expect_error<std::invalid_argument>([&] { scene_with("sitting", spoil); },
                                                 std::string("got ") + option);
  };
  using Options = SyntheticSceneOptions;
  expect_named("still_persons = 3", [](Options& o) { o.still_persons = 3; });
  expect_named("stop_s", [](Options& o) { o.stop_s = -1; });
  expect_named("go_s", [](Options& o) { o.go_s = 0.5; });
  expect_named("box_speed_m_s", [](Options& o) { o.box_speed_m_s = 3; });
  expect_named("persons, with a carried box,", [](Options& o) {
    o.persons = o.still_persons = 0;
    o.moving_box = MovingBox::carried;
  });
  expect_named("camera_translation", [](Options& o) { o.camera_translation = -1; });
  expect_named("camera_rate", [](Options& o) { o.camera_rate = 0; });
  expect_named("camera_shift_m", [](Options& o) { o.camera_shift_m = 2; });
  expect_named("focal_px", [](Options& o) { o.focal_px = -1; });
  expect_named("focal_px", [](Options& o) { o.focal_px = 9000; });
  expect_named("light_drift", [](Options& o) { o.light_drift = 0.6; });
  expect_named("reflection", [](Options& o) { o.reflection = 0.6; });
}

// The frozen pixels of these levels, as in synthetic_scene_levels_test.cpp.
#if defined(__x86_64__) && !defined(__FMA__) && defined(__GLIBC__)
TEST(Motion, FirstAndLastFrameMatchThePublishedPixels) {
  const std::vector<std::pair<std::string, std::pair<std::uint64_t, std::uint64_t>>> expected = {
      {"sitting", {1300765098789926942U, 8140477936586340685U}},
      {"stop_and_go", {8329848012751376884U, 17427142775383350252U}},
      {"pushed", {1756330466372943736U, 6914467892159421239U}},
      {"pushed_slow", {1756330466372943736U, 3714312487058359937U}},
      {"pushed_plain", {10529493267521258800U, 6710475096809329320U}},
      {"carried", {7245361454897873263U, 14795734075037750683U}},
      {"carried_slow", {2093174306727023801U, 10362895111560306407U}},
      {"carried_plain", {17757055629962910006U, 12427285659464376265U}},
      {"still_camera", {2518893209161929878U, 11537929773829522236U}},
      {"rotation", {9647609409654272491U, 11668171483106606233U}},
      {"fast", {18041224946266808254U, 1700373307117286846U}},
      {"crowd", {16781863419835289237U, 4747611708507015620U}},
  };
  const auto hash = [](const SyntheticFrame& frame) {
    std::uint64_t pixels = pixel_hash(frame.frame.image);
    pixels = pixel_hash(frame.frame.depth, pixels);
    pixels = pixel_hash(painted(frame.true_segmentation), pixels);
    pixels = pixel_hash(painted(frame.poor_segmentation), pixels);
    return pixel_hash(frame.moving_mask, pixels);
  };
  for (const auto& [name, hashes] : expected) {
    const SyntheticScene scene(small(name));
    EXPECT_EQ(hash(scene.render(0)), hashes.first) << name;
    EXPECT_EQ(hash(scene.render(scene.size() - 1)), hashes.second) << name;
  }
}
#endif

}  // namespace
}  // namespace dynfilter
