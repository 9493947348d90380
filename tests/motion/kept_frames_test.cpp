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
void push(detail::MotionMemory& memory, int index, bool is_camera_known, bool keeps = true) {
  memory.now.timestamp_s = index;
  memory.now.motion.reset();
  if (is_camera_known) memory.now.motion = motion_between(index - 1, index);
  memory.push({}, keeps);
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

TEST(KeptFrames, AreDroppedWhereTheCameraIsLost) {
  detail::MotionMemory memory;
  const auto are_kept = [&] { return memory.kept[0].frames_back + memory.kept[1].frames_back > 0; };
  for (int i = 0; i < 30; ++i) {
    push(memory, i, i > 0 && i != 20);
    // After the loss it takes four frames, the first of which may be the lost one.
    EXPECT_EQ(are_kept(), (i >= 3 && i < 20) || i >= 23) << i;
  }
  memory.forget();
  EXPECT_FALSE(are_kept());
  for (int i = 0; i < 10; ++i) push(memory, i, i > 0, false);
  EXPECT_FALSE(are_kept());
  for (int i = 10; i < 20; ++i) push(memory, i, true);
  EXPECT_TRUE(are_kept());
  push(memory, 20, true, false);
  EXPECT_FALSE(are_kept());
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

/// Returns what is measured of a feature that shifts by so many pixels in the last frame, and by 9
/// since a kept one, where a camera at rest would see it 2 m away.
FeatureMotion measured_with_kept(float last_shift_px) {
  const PinholeCamera camera{400, 400, 320, 240};
  const std::vector<cv::KeyPoint> keypoints = {{300, 200, 7}};
  FrameView frame;
  frame.depth = cv::Mat1f(480, 640, 2.0F);
  detail::MotionMemory memory;
  memory.kept[0].frames_back = 9;
  detail::MotionMeasurement measured;
  const auto track_over = [&](std::size_t baseline, double duration_s, float shift_px) {
    detail::MotionBaseline& over = measured.baselines[baseline];
    over.is_used = true;
    over.duration_s = duration_s;
    over.tracks = {{{300 + shift_px, 200}, true}};
  };
  track_over(0, 1 / 30.0, last_shift_px);
  track_over(detail::kept_baseline, 9 / 30.0, 9);
  const FeatureTracker tracker;
  for (ImagePyramid* one :
       {&memory.now.pyramid, &memory.past[0].pyramid, &memory.kept[0].pyramid}) {
    tracker.build(cv::Mat1b(480, 640, std::uint8_t{90}), *one);
  }
  Workspace workspace;
  const MotionJudgeOptions options;
  const FilterInput input{frame, {}, keypoints};
  const detail::MotionContext context{input, camera, options, false, memory, measured, workspace};
  measure_places(context);
  measure_motions(context);
  return measured.motions.at(0);
}

/// Over many frames, a track fails more easily.
TEST(KeptFrames, SayOnlyWhatTheLastFramesDoNot) {
  const FeatureMotion fast = measured_with_kept(4), slow = measured_with_kept(0);
  EXPECT_GT(fast.ratio, 1);
  EXPECT_EQ(fast.baseline, 0U);
  EXPECT_GT(slow.ratio, 1);
  EXPECT_EQ(slow.baseline, detail::kept_baseline);
}

TEST(KeptFrames, AreNotUsedByAJudgeThatKeepsNone) {
  Rig rig(keeping(true));
  const std::vector<Shot>& shots = shots_of_a_slow_person();
  for (std::size_t i = 0; i < 12; ++i) rig.see_without_masks(shots[i]);
  const MotionJudge other(camera(), rig.state, keeping(false));
  FeatureLabels labels(shots[12].keypoints.size(), {});
  other({shots[12].rendered.frame, {}, shots[12].keypoints}, labels, rig.workspace);
  EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::applied);
  EXPECT_EQ(labels.statistics().motion.baselines, 2U);
}

/// The host's motions, one after the other, are too coarse over many frames.
TEST(KeptFrames, AreNotUsedWhereOnlyTheHostKnowsTheCamera) {
  Rig rig(keeping(true));
  const std::vector<Shot>& shots = shots_of_a_slow_person();
  for (std::size_t i = 0; i < 12; ++i) {
    rig.see_without_masks(shots[i]);
    const CameraPose then = shots[i].rendered.pose, now = shots[i + 1].rendered.pose;
    PosePrior known;
    known.pose = {then.rotation.t() * now.rotation,
                  then.rotation.t() * (now.translation - then.translation)};
    known.is_trusted = true;
    rig.state.expect_motion(known);
  }
  Shot few = shots[12];
  few.keypoints.resize(5);
  const FeatureLabels labels = rig.see_without_masks(few);
  EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::applied);
  EXPECT_EQ(labels.statistics().motion.baselines, 2U);
}

/// Breaks what a state knows after twelve frames, then compares it with a new one.
template <class Break>
void expect_new_after(const Break& break_off) {
  const std::vector<Shot>& shots = shots_of_a_slow_person();
  Rig known(keeping(true)), fresh(keeping(true));
  for (std::size_t i = 0; i < 12; ++i) known.see_without_masks(shots[i]);
  break_off(known);
  for (const Shot& shot : shots) {
    const FeatureLabels got = known.see_without_masks(shot), want = fresh.see_without_masks(shot);
    EXPECT_TRUE(are_equal(got, want));
    EXPECT_EQ(got.statistics().motion.baselines, want.statistics().motion.baselines);
    EXPECT_EQ(got.statistics().motion.outcome, want.statistics().motion.outcome);
  }
}

TEST(KeptFrames, AreForgottenWithTheOthers) {
  expect_new_after([](Rig& /*rig*/) {});  // the first frame comes again: a step back in time
  expect_new_after([](Rig& rig) { rig.state.reset(); });
  expect_new_after([](Rig& rig) {
    const Shot& next = shots_of_a_slow_person()[12];
    FrameView other = next.rendered.frame;
    cv::resize(other.image, other.image, {}, 0.5, 0.5);
    other.depth.release();
    EXPECT_EQ(rig.see(other, {}, {}).statistics().motion.outcome, MotionOutcome::started);
  });
}

}  // namespace
}  // namespace dynfilter::testing
