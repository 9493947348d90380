// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The camera's motion where a wall is nearly all that is seen: a shift and a turn look alike there.

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_judge.hpp"
#include "dynfilter/motion/relative_pose.hpp"
#include "wall_scene.hpp"

namespace dynfilter::detail {
namespace {

const Thing cart{{60, 200, 250, 200}, 1.9, {0.012, 0, 0}, Suspicion::none, 15};
const Thing standing_person{{400, 100, 120, 360}, 1.8, {}, Suspicion::standing, 8};

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Returns the options with a smallest gain of the last two poses; infinity: they are never taken.
MotionJudgeOptions gaining(double min_agreement_gain) {
  MotionJudgeOptions options;
  options.min_agreement_gain = min_agreement_gain;
  return options;
}

double error_m(const RelativePoseEstimate& estimate, const RelativePose& truth) {
  return cv::norm(estimate.pose.translation - truth.translation);
}

RelativePose moved(double z_m) {
  RelativePose move;
  move.translation = {0, 0, z_m};
  return move;
}

/// A cart before a wall looks as if the camera had moved by the cart's motion, and the wall allows
/// it. That a person who stands would then move is no proof, but a camera that only turns explains
/// more.
TEST(MotionPose, IsNotCapturedByACartWhereTheCameraRestsOrTurns) {
  RelativePose turn;
  turn.rotation = {std::cos(0.01), 0, std::sin(0.01), 0, 1, 0, -std::sin(0.01), 0, std::cos(0.01)};
  for (const RelativePose& truth : {RelativePose(), turn}) {
    WallScene scene(truth, {cart, standing_person});
    const RelativePoseEstimate estimate = scene.estimated();
    EXPECT_TRUE(estimate.is_trusted);
    EXPECT_EQ(error_m(estimate, truth), 0);
    EXPECT_LT(cv::norm(estimate.pose.rotation - truth.rotation), 1e-3);

    const MotionJudgeOptions never = gaining(infinity);
    EXPECT_GT(error_m(scene.estimated(true, never), truth), 0.008);
    // Where no masks are known, most features may be on persons: no pose is taken for a turn.
    EXPECT_NE(error_m(scene.estimated(false), truth), 0);
  }
}

/// A camera that moves as well: a person who stands agrees with its true motion only.
TEST(MotionPose, IsNotCapturedByACartWhereAPersonStands) {
  RelativePose move;
  move.translation = {0.008, 0, 0};
  const MotionJudgeOptions never = gaining(infinity);
  Thing person = standing_person;
  person.spacing_px = 12;
  WallScene scene(move, {cart, person});
  EXPECT_TRUE(scene.estimated().is_trusted);
  EXPECT_LT(error_m(scene.estimated(), move), 1e-3);
  EXPECT_GT(error_m(scene.estimated(true, never), move), 0.008);
  scene.prior = PosePrior{scene.estimated(true, never).pose, 0.02, 0.02, true};
  EXPECT_GT(error_m(scene.estimated(), move), 0.008) << "a trusted prior knows better";
}

/// Where most features are on masks, they may be those of a crowd: nobody asks them.
TEST(MotionPose, IsNotThatOfMasksThatHoldMostFeatures) {
  RelativePose move;
  move.translation = {0.008, 0, 0};
  Thing crowd = standing_person;
  crowd.spacing_px = 7;
  const MotionJudgeOptions never = gaining(infinity);
  WallScene scene(move, {cart, crowd});
  EXPECT_EQ(error_m(scene.estimated(), move), error_m(scene.estimated(true, never), move));
}

/// A turn explains the wall and the person far away, the true motion also the one who is near.
TEST(MotionPose, IsNoTurnWhereAPersonShowsThatTheCameraMoves) {
  RelativePose move;
  move.translation = {0.004, 0, 0};
  const Thing far_person{{330, 200, 290, 270}, 3.5, {}, Suspicion::standing, 16};
  const Thing near_person{{200, 20, 110, 170}, 1.5, {}, Suspicion::standing, 12};
  EXPECT_EQ(error_m(WallScene(move, {cart, far_person}).estimated(), move), 0.004) << "a turn";
  WallScene scene(move, {cart, far_person, near_person});
  EXPECT_TRUE(scene.estimated().is_trusted);
  EXPECT_LT(error_m(scene.estimated(), move), 1e-3);
}

/// A few features on masks more that agree say nothing: that may be chance.
TEST(MotionPose, IsNotThatOfMasksOnWhichFewFeaturesAgree) {
  RelativePose move;
  move.translation = {0.008, 0, 0};
  Thing person = standing_person;
  person.depth_m = 0.8;
  person.spacing_px = 40;
  const Thing walking{{60, 200, 250, 200}, 1.9, {0.1, 0.1, 0}, Suspicion::standing, 15};
  const MotionJudgeOptions never = gaining(infinity);
  const MotionJudgeOptions always = gaining(1);
  WallScene scene(move, {person, walking});
  EXPECT_EQ(error_m(scene.estimated(), move), error_m(scene.estimated(true, never), move));
  EXPECT_NE(error_m(scene.estimated(true, always), move),
            error_m(scene.estimated(true, never), move));
}

/// Before a wall, a person who walks looks like one who stands before another camera's motion.
/// Nothing asks him, nor what moves with the camera.
TEST(MotionPose, IsNotThatOfWhatIsNotKnownToStand) {
  RelativePose move;
  move.translation = {0.008, 0, 0};
  const MotionJudgeOptions never = gaining(infinity);
  Thing person = standing_person;
  person.spacing_px = 12;
  person.motion_m = {0.012, 0, 0};
  EXPECT_GT(error_m(WallScene(move, {person}).estimated(), move), 0.015) << "nothing to tell apart";
  for (const Suspicion suspicion : {Suspicion::moving, Suspicion::foreign}) {
    person.suspicion = suspicion;
    WallScene scene(move, {person});
    EXPECT_LT(error_m(scene.estimated(), move), 1e-3);
    EXPECT_EQ(error_m(scene.estimated(), move), error_m(scene.estimated(true, never), move));
  }
}

/// What moves with the camera agrees with a camera that rests, and has no voice.
TEST(MotionPose, IsNoTurnThatOnlyTheCamerasOwnBodyAgreesWith) {
  const RelativePose move = moved(0.006);
  const Thing near{{60, 200, 500, 50}, 1.9, {}, Suspicion::none, 20};
  Thing body{{40, 260, 560, 200}, 1.0, move.translation, Suspicion::moving, 15};
  EXPECT_EQ(error_m(WallScene(move, {near, body}).estimated(), move), 0.006) << "it has a voice";
  body.suspicion = Suspicion::foreign;
  EXPECT_LT(error_m(WallScene(move, {near, body}).estimated(), move), 1e-3);
}

TEST(MotionPose, IsNotThatOfAPersonWhoWalks) {
  RelativePose move;
  move.translation = {0.02, 0.004, -0.01};
  Thing walking = standing_person;
  walking.box = {20, 60, 400, 410};
  walking.motion_m = {0.03, 0, 0.01};
  WallScene scene(move, {walking});
  EXPECT_TRUE(scene.estimated().is_trusted);
  EXPECT_LT(error_m(scene.estimated(), move), 0.004);
}

/// Returns a person whom the camera follows: he hardly moves in the image.
Thing person_ahead(double z_m) {
  return {{170, 40, 300, 430}, 2.0, {0, 0, z_m}, Suspicion::standing, 10};
}

TEST(MotionPose, IsNotATurnOnlyBecauseAPersonIsFollowed) {
  WallScene scene(moved(0.01), {person_ahead(0.01)});
  const RelativePoseEstimate estimate = scene.estimated();
  EXPECT_TRUE(estimate.is_trusted);
  EXPECT_LT(error_m(estimate, moved(0.01)), 0.003);
}

TEST(MotionPose, IsNoTurnThatThePriorRulesOut) {
  WallScene scene(moved(0.0167), {person_ahead(0.0167)});
  scene.prior = PosePrior();
  scene.prior->pose = moved(0.0167);
  scene.prior->max_translation_m = 0.003;
  const RelativePoseEstimate estimate = scene.estimated();
  EXPECT_TRUE(estimate.is_trusted);
  EXPECT_LE(error_m(estimate, moved(0.0167)), 0.003);
}

TEST(MotionPose, IsUnknownWhereAPersonHidesEverything) {
  Thing person = person_ahead(0.02);
  person.box = {30, 10, 590, 460};
  WallScene scene(moved(0.02), {person});
  scene.last = moved(0.02);
  const RelativePoseEstimate estimate = scene.estimated();
  EXPECT_FALSE(estimate.is_trusted);
  EXPECT_LT(estimate.observations, 20U);
}

/// Who stood until now may walk again: alone, he does not tell the camera's motion, nor against
/// what nobody suspects.
TEST(MotionPose, IsNotThatOfAStandingPersonAgainstTheWall) {
  const cv::Rect left_of_wall(0, 0, 450, 200), wall(0, 0, 640, 200);
  for (const cv::Rect& without_depth : {left_of_wall, wall}) {
    Thing starting = standing_person;
    starting.box = {380, 200, 240, 250};
    starting.spacing_px = without_depth == wall ? 16 : 15;
    starting.motion_m = {0, 0, -0.05};
    WallScene scene({}, {starting});
    scene.depth()(without_depth).setTo(0);
    EXPECT_EQ(scene.estimated().is_trusted, without_depth != wall);
    EXPECT_LT(error_m(scene.estimated(), {}), 0.005) << "his motion would make 50 mm";
  }
}

TEST(MotionPose, IsThatOfCompensatedFeaturesWhereOthersDoNotSuffice) {
  const RelativePose move = moved(0.02);
  WallScene scene(move, {{{30, 10, 590, 230}, 2.0, {}, Suspicion::compensated, 10},
                         {{30, 240, 590, 230}, 1.5, {}, Suspicion::compensated, 10}});
  const RelativePoseEstimate estimate = scene.estimated();
  EXPECT_TRUE(estimate.is_trusted);
  EXPECT_LT(error_m(estimate, move), 1e-3);
}

TEST(MotionPose, IsThatOfACameraThatMoves) {
  RelativePose move;
  move.translation = {0.012, 0.002, -0.004};
  Thing still_cart = cart;
  still_cart.motion_m = {};
  WallScene scene(move, {still_cart, standing_person});
  const RelativePoseEstimate estimate = scene.estimated();
  EXPECT_TRUE(estimate.is_trusted);
  EXPECT_LT(error_m(estimate, move), 1e-3);
}

/// Features that compensation removed sharpen the pose if they are static, and do not bend it if
/// they move.
TEST(MotionPose, IsSharpenedByCompensatedFeaturesThatAgree) {
  RelativePose move;
  move.translation = {0.012, 0.002, 0};
  const auto error_with = [&](const cv::Vec3d& motion_m, const MotionJudgeOptions& options,
                              const cv::Rect& box = {200, 150, 240, 300}) {
    Thing person{box, 2.0, motion_m, Suspicion::compensated, 8};
    return error_m(WallScene(move, {person}).estimated(true, options), move);
  };
  MotionJudgeOptions always, never;
  always.max_worse_fit = 1000;
  never.max_worse_fit = never.max_worse_fit_px = 0;
  EXPECT_LT(error_with({}, {}), 1e-3);
  EXPECT_GT(error_with({}, never), 3 * error_with({}, {}));
  const cv::Vec3d walk(0, 0.03, 0);
  const cv::Rect crowd(20, 100, 600, 370);
  EXPECT_EQ(error_with(walk, {}, crowd), error_with(walk, never, crowd));
  EXPECT_GT(error_with(walk, always, crowd), error_with(walk, {}, crowd));
}

/// A corner's own pixel often has no depth; the surface around it has.
TEST(MotionPose, TakesTheDepthAroundAFeature) {
  RelativePose move;
  move.translation = {0.012, 0.002, 0};
  WallScene scene(move, {{{200, 150, 240, 300}, 2.0, {}, Suspicion::none, 8}});
  const std::size_t before = scene.estimated().observations;
  for (int y = 0; y < wall_image_size.height; ++y) {
    for (int x = 1; x < wall_image_size.width; x += 2) scene.depth().at<float>(y, x) = 0;
  }
  EXPECT_EQ(scene.estimated().observations, before);
  EXPECT_LT(error_m(scene.estimated(), move), 1e-3);
  MotionJudgeOptions own_pixel_only;
  own_pixel_only.max_pose_depth_range_m = 0;
  EXPECT_LT(scene.estimated(true, own_pixel_only).observations, before);
}

/// A camera may be fast already when the first of its motions is measured.
TEST(MotionPose, WithoutMasksIsOnlyHeldBackByALastMotion) {
  const RelativePose fast = moved(0.05);  // 1.5 m/s
  Thing standing = cart;
  standing.motion_m = {};
  WallScene scene(fast, {standing, standing_person});
  EXPECT_TRUE(scene.estimated(false).is_trusted);
  EXPECT_LT(error_m(scene.estimated(false), fast), 1e-3);
  scene.last = RelativePose();
  EXPECT_FALSE(scene.estimated(false).is_trusted) << "5 m/s2 do not allow for it";
}

/// A camera goes on while frames are dropped, and by another one after that.
TEST(MotionPose, WithoutMasksGoesOnOverDroppedFrames) {
  Thing standing = cart;
  standing.motion_m = {};
  for (const auto& [last_frames, frames] :
       {std::pair(1, 1), std::pair(1, 2), std::pair(1, 3), std::pair(3, 1)}) {
    const RelativePose motion = moved(0.03 * frames);
    WallScene scene(motion, {standing, standing_person});
    scene.last = moved(0.03 * last_frames);
    scene.last_s = last_frames / 30.0;
    scene.now_s = frames / 30.0;
    EXPECT_TRUE(scene.estimated(false).is_trusted) << last_frames << ", " << frames;
    EXPECT_LT(error_m(scene.estimated(false), motion), 1e-3) << last_frames << ", " << frames;
  }
}

/// A host's priors may begin in any frame. Without depth, they are all that tells the camera.
TEST(MotionPose, OverTheLongBaselineNeedsThePriorsOfAllItsFrames) {
  const RelativePose frame = moved(0.01);
  WallScene scene(moved(0.03), {cart, standing_person});
  scene.prior = PosePrior{frame, 0.01, 0.02, true};
  scene.depth().setTo(0);
  EXPECT_TRUE(scene.is_long_used({frame, frame, frame}));
  EXPECT_FALSE(scene.is_long_used({frame, {}, {}}));
  EXPECT_FALSE(scene.is_long_used({frame, frame, {}}));
}

/// 0 is no limit, also around what the host knows of the short baseline.
TEST(MotionPose, OverTheLongBaselineMayBeFarFromThePriorsWithoutLimits) {
  Thing standing = cart;
  standing.motion_m = {};
  WallScene scene(moved(0.03), {standing, standing_person});
  const RelativePose frame = moved(0.002);
  scene.prior = PosePrior{frame, 0.01, 0.02, true};
  MotionJudgeOptions options;
  options.max_baseline_difference_px = std::numeric_limits<double>::infinity();
  const auto error_over_long = [&] {
    EXPECT_TRUE(scene.is_long_used({frame, frame, frame}, options));
    return error_m(scene.long_pose(), moved(0.03));
  };
  options.max_acceleration_m_s2 = 0.1;
  EXPECT_GT(error_over_long(), 0.02);
  options.max_acceleration_m_s2 = 0;
  EXPECT_LT(error_over_long(), 1e-3);
}

TEST(MotionPose, RefusesNonsense) {
  MotionState state;
  for (double MotionJudgeOptions::*const option :
       {&MotionJudgeOptions::max_pose_depth_range_m, &MotionJudgeOptions::max_worse_fit,
        &MotionJudgeOptions::max_worse_fit_px, &MotionJudgeOptions::min_agreement_gain,
        &MotionJudgeOptions::agreement_px, &MotionJudgeOptions::max_thing_depth_m,
        &MotionJudgeOptions::stale_age_s, &MotionJudgeOptions::max_baseline_difference_px,
        &MotionJudgeOptions::fringe_untracked_px, &MotionJudgeOptions::stale_fringe_untracked_px}) {
    for (const double number : {-1.0, std::nan("")}) {
      MotionJudgeOptions options;
      options.*option = number;
      EXPECT_THROW(MotionJudge(pinhole, state, options), std::invalid_argument);
    }
  }
}

/// Three frames and the long baseline over them are measured each by themselves.
TEST(MotionPose, OverTheLongBaselineIsLeftOutWhereItsFramesContradictIt) {
  Thing still_cart = cart;
  still_cart.motion_m = {};
  WallScene scene(moved(0.03), {still_cart, standing_person});
  const RelativePose frame = moved(0.01);
  EXPECT_TRUE(scene.is_long_used({frame, frame, frame}));
  EXPECT_TRUE(scene.is_long_used({moved(0.011), frame, moved(0.009)}));
  RelativePose captured = frame;
  captured.translation[0] = 0.05;
  EXPECT_FALSE(scene.is_long_used({captured, frame, frame}));
  EXPECT_FALSE(scene.is_long_used({frame, captured, frame}));
  EXPECT_FALSE(scene.is_long_used({frame, frame, captured}));
  // Nothing that it moves past may contradict more than what ends behind the camera.
  EXPECT_FALSE(scene.is_long_used({moved(-20), frame, frame}));
  // Without a pose of every frame, nothing contradicts.
  EXPECT_TRUE(scene.is_long_used({captured, {}, frame}));
  EXPECT_TRUE(scene.is_long_used({captured, frame, {}}));
  MotionJudgeOptions never;
  never.max_baseline_difference_px = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(scene.is_long_used({captured, frame, frame}, never));
}

/// Over nine frames, three times as much may add up as over three.
TEST(MotionPose, ToAKeptFrameMayDifferByMore) {
  Thing still_cart = cart;
  still_cart.motion_m = {};
  WallScene scene(moved(0.03), {still_cart, standing_person});
  RelativePose kept_from_last = moved(0.02);
  EXPECT_TRUE(scene.is_kept_used(moved(0.01), kept_from_last));
  kept_from_last.translation[0] = 0.05;  // the nearest features differ by 14 px
  EXPECT_FALSE(scene.is_long_used({moved(0.01), kept_from_last, RelativePose()}));
  EXPECT_TRUE(scene.is_kept_used(moved(0.01), kept_from_last));
  kept_from_last.translation[0] = 0.1;
  EXPECT_FALSE(scene.is_kept_used(moved(0.01), kept_from_last));
}

}  // namespace
}  // namespace dynfilter::detail
