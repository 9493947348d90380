// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Frames that are kept for longer, to see what moves slowly.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "motion/motion_measurement.hpp"
#include "motion/motion_memory.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Place of a camera in the first camera's frame.
RelativePose place_of(int index) {
  const double angle = 0.02 * index * index;
  RelativePose place;
  place.rotation = {std::cos(angle),  0, std::sin(angle), 0, 1, 0,
                    -std::sin(angle), 0, std::cos(angle)};
  place.translation = {0.1 * index, 0.3 * std::sin(index), 0.05 * index * index};
  return place;
}

/// Returns the motion that takes a point of camera `now` into camera `then`.
RelativePose motion_between(int then, int now) {
  const RelativePose place_then = place_of(then), place_now = place_of(now);
  const cv::Matx33d back = place_then.rotation.t();
  return {back * place_now.rotation, back * (place_now.translation - place_then.translation)};
}

/// The index of a frame is its time.
void push(detail::MotionMemory& memory, int index, bool is_camera_known) {
  memory.now.timestamp_s = index;
  memory.now.motion.reset();
  if (is_camera_known) memory.now.motion = motion_between(index - 1, index);
  memory.push({}, true);
}

TEST(KeptFrames, AreFollowedFromFrameToFrame) {
  detail::MotionMemory memory;
  for (int i = 0; i < 40; ++i) {
    push(memory, i, i > 0);
    EXPECT_EQ(memory.kept[0].frames_back > 0, i >= 7) << i;
    for (const detail::MotionMemory::KeptFrame& kept : memory.kept) {
      if (kept.frames_back == 0) continue;
      const int index = i + 1 - static_cast<int>(kept.frames_back);
      EXPECT_EQ(kept.timestamp_s, index);
      const RelativePose want = motion_between(index, i);
      EXPECT_LT(cv::norm(kept.kept_from_last.rotation - want.rotation), 1e-9);
      EXPECT_LT(cv::norm(kept.kept_from_last.translation - want.translation), 1e-9);
    }
    if (i >= 7) {
      EXPECT_GE(memory.kept[0].frames_back, 8U);
      EXPECT_LE(memory.kept[0].frames_back, 11U);
    }
  }
}

/// Returns 18 frames of a person who glides through the picture at 0.07 m/s, with their features.
const std::vector<Shot>& shots_of_a_slow_person() {
  static std::vector<Shot> shots;
  if (!shots.empty()) return shots;
  SyntheticSceneOptions options = small_scene(0.07);
  options.limb_swing = 0;
  const SyntheticScene scene(options);
  for (int i = 0; i < 18; ++i) {
    Shot shot{scene.render(i), {}};
    cv::Mat grey;
    std::vector<cv::Point2f> corners;
    cv::cvtColor(shot.rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
    cv::goodFeaturesToTrack(grey, corners, 800, 1e-3, 6);
    cv::KeyPoint::convert(corners, shot.keypoints);
    shots.push_back(std::move(shot));
  }
  return shots;
}

MotionJudgeOptions keeping(bool uses_kept_frames) {
  MotionJudgeOptions options;
  options.uses_kept_frames = uses_kept_frames;
  return options;
}

/// What was found of a person of whom no masks are known.
struct Found {
  std::size_t moving = 0, removed = 0, others = 0, others_removed = 0;
};

Found found_of_a_slow_person(bool uses_kept_frames) {
  Rig rig(keeping(uses_kept_frames));
  Found found;
  for (std::size_t i = 0; i < shots_of_a_slow_person().size(); ++i) {
    const Shot& shot = shots_of_a_slow_person()[i];
    const FeatureLabels labels = rig.see_without_masks(shot);
    const std::size_t without = i == 0 ? 0 : i < 3 ? 1 : 2;
    EXPECT_EQ(labels.statistics().motion.baselines, uses_kept_frames && i >= 8 ? 3 : without) << i;
    if (i < 10) continue;
    for (std::size_t f = 0; f < labels.size(); ++f) {
      const cv::Point pixel = nearest_pixel(shot.keypoints[f].pt);
      const bool moves = shot.rendered.moving_mask.at<std::uint8_t>(pixel) != 0;
      ++(moves ? found.moving : found.others);
      if (labels.is_removed(f)) ++(moves ? found.removed : found.others_removed);
    }
  }
  return found;
}

TEST(KeptFrames, FindWhatMovesSlowly) {
  const Found without = found_of_a_slow_person(false), with = found_of_a_slow_person(true);
  EXPECT_GT(with.moving, 300U);
  EXPECT_LT(without.removed, without.moving / 10);
  EXPECT_GT(with.removed, with.moving * 2 / 3);
  EXPECT_LT(with.others_removed, with.others / 100);
}

}  // namespace
}  // namespace dynfilter::testing
