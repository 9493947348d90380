// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/motion_measurement.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/relative_pose.hpp"

namespace dynfilter::detail {
namespace {

constexpr double frame_s = 1 / 30.0;
const cv::Size image_size(640, 480);

RelativePose turned(double angle_rad) {
  RelativePose pose;
  pose.rotation = {std::cos(angle_rad),  0, std::sin(angle_rad), 0, 1, 0,
                   -std::sin(angle_rad), 0, std::cos(angle_rad)};
  return pose;
}

/// Estimates the pose over the long baseline without masks, for a camera that has turned by so much
/// in each of its frames.
RelativePoseEstimate long_pose(double turn_rad) {
  const PinholeCamera camera{400, 400, 320, 240};
  std::vector<cv::KeyPoint> keypoints;
  for (int y = 20; y < image_size.height; y += 20) {
    for (int x = 20; x < image_size.width; x += 20) keypoints.emplace_back(cv::Point(x, y), 7.0F);
  }
  FrameView frame;
  frame.depth = cv::Mat(image_size, CV_32FC1);
  cv::RNG(3).fill(frame.depth, cv::RNG::UNIFORM, 1.0, 4.0);
  const FilterInput input{frame, {}, keypoints};
  MotionMemory memory;
  memory.known = past_frames;
  for (MotionMemory::Frame& past : memory.past) past.motion = turned(turn_rad);
  MotionMeasurement measured;
  measured.suspicions.assign(keypoints.size(), Suspicion::none);
  measured.baselines[0].duration_s = frame_s;
  measured.baselines[0].pose.pose = turned(turn_rad);
  Workspace workspace;
  const MotionJudgeOptions options;
  const MotionContext context{input, camera, options, false, memory, measured, workspace};
  measure_places(context);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const cv::Point3d point =
        camera.point(measured.ideal[i], *frame.depth_m(input.features.pixel(i)));
    const auto then = camera.project(turned(3 * turn_rad) * point);
    measured.baselines[1].tracks.push_back({cv::Point2f(*then), true});
  }
  estimate_pose(context, RelativePoseEstimator(camera), 1);
  EXPECT_EQ(measured.baselines[1].is_used, measured.baselines[1].pose.is_trusted);
  return measured.baselines[1].pose;
}

/// The limits of the camera's inertia are those around a motion that goes on.
TEST(MotionMeasurement, KnowsTheLongMotionOfACameraThatTurnsEvenly) {
  for (const double turn_rad : {0.0, 0.01, 0.04, 0.08}) {
    const RelativePoseEstimate estimate = long_pose(turn_rad);
    EXPECT_TRUE(estimate.is_trusted) << turn_rad;
    EXPECT_LT(cv::norm(estimate.pose.rotation - turned(3 * turn_rad).rotation), 1e-4) << turn_rad;
    EXPECT_LT(cv::norm(estimate.pose.translation), 1e-4) << turn_rad;
  }
}

TEST(MotionMeasurement, ExpectsStaticFeaturesAndACameraThatMovesOn) {
  const PinholeCamera camera{400, 400, 320, 240};
  const std::vector<cv::KeyPoint> keypoints = {{100, 100, 7}, {400, 300, 7}, {500, 50, 7}};
  FrameView frame;
  frame.depth = cv::Mat1f(image_size, 2.0F);
  frame.depth.at<float>(50, 500) = 0;  // no depth: only the camera's turn moves it
  const FilterInput input{frame, {}, keypoints};
  const FeatureTracker tracker;
  MotionMemory memory;
  for (MotionMemory::Frame* one : {&memory.now, &memory.past[0]}) {
    tracker.build(cv::Mat1b(image_size, std::uint8_t{90}), one->pyramid);
  }
  MotionMeasurement measured;
  Workspace workspace;
  const MotionJudgeOptions options;
  const MotionContext context{input, camera, options, false, memory, measured, workspace};
  for (const int frames : {1, 2}) {  // 2: one was dropped
    memory.past[1].timestamp_s = 0;
    memory.past[0].timestamp_s = 1;
    memory.now.timestamp_s = 1 + frames;
    RelativePose last = turned(0.02), motion = turned(0.02 * frames);
    last.translation = {0.05, -0.02, 0.1};
    motion.translation = frames * last.translation;
    memory.past[0].motion = last;
    track_back(context, tracker, 0);
    ASSERT_EQ(measured.scratch.expected.size(), keypoints.size());
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const cv::Point3d ray = camera.point(keypoints[i].pt, 1);
      const auto place =
          i < 2 ? camera.project(motion * (2 * ray)) : camera.project(turned(0.02 * frames) * ray);
      const double tolerance_px = i < 2 ? 1e-3 : 0.1;  // at 1000 m, the shift of 0.2 m is 0.08 px
      EXPECT_LT(cv::norm(cv::Point2d(measured.scratch.expected[i]) - *place), tolerance_px) << i;
    }
  }
}

TEST(MotionMeasurement, SaysNothingOfAFeatureWithoutTrack) {
  const PinholeCamera camera{400, 400, 320, 240};
  const std::vector<cv::KeyPoint> keypoints = {{100, 100, 7}, {200, 100, 7}};
  const FilterInput input{{}, {}, keypoints};
  MotionMemory memory;
  MotionMeasurement measured;
  measured.baselines[0].is_used = true;
  measured.baselines[0].duration_s = frame_s;
  measured.baselines[0].tracks = {{{100, 100}, true}, {{200, 100}, false}};
  Workspace workspace;
  const MotionJudgeOptions options;
  const MotionContext context{input, camera, options, false, memory, measured, workspace};
  measure_places(context);
  measure_motions(context);
  EXPECT_EQ(measured.motions[0].evidence, MotionEvidence::quiet);
  EXPECT_EQ(measured.motions[1].evidence, MotionEvidence::unknown);
}

/// Texture of a wall, shifted to the right.
cv::Mat1b wall(double shift_px) {
  cv::Mat1b image(60, 80);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image(y, x) = cv::saturate_cast<std::uint8_t>(128 + 60 * std::sin(1.1 * (x - shift_px)) +
                                                    60 * std::sin(0.9 * y + 0.3 * (x - shift_px)));
    }
  }
  return image;
}

/// What a camera sees of a feature on the wall, and what it saw in the frame before.
struct View {
  cv::Mat1b then;
  cv::Point2f feature{40, 30};
  FeatureTrack track;
  cv::Mat1f depth_m = cv::Mat1f(60, 80, 3.0F);
  cv::Mat1f depth_then_m = cv::Mat1f(60, 80, 3.0F);
  double camera_shift_m = 0;     // a point 3 m away shifts by 400 pixels a metre, over 3
  double camera_approach_m = 0;  // since then, along the view
  bool is_pose_known = true;
};

/// Calls `action` with the context of a view of one feature.
template <class Action>
void with_context(const View& view, const Action& action) {
  const PinholeCamera camera{400, 400, 40, 30};
  const std::vector<cv::KeyPoint> keypoints = {{view.feature, 7}};
  FrameView frame;
  frame.depth = view.depth_m;
  const FilterInput input{frame, {}, keypoints};
  MotionMemory memory;
  const FeatureTracker tracker;
  tracker.build(wall(0), memory.now.pyramid);
  tracker.build(view.then, memory.past[0].pyramid);
  memory.past[0].frame.depth = view.depth_then_m;
  MotionMeasurement measured;
  measured.baselines[0].is_used = view.is_pose_known;
  measured.baselines[0].duration_s = frame_s;
  measured.baselines[0].pose.pose.translation = {view.camera_shift_m, 0, view.camera_approach_m};
  measured.baselines[0].tracks = {view.track};
  Workspace workspace;
  const MotionJudgeOptions options;
  const MotionContext context{input, camera, options, false, memory, measured, workspace};
  measure_places(context);
  action(context);
}

Appearance appearance(const View& view) {
  Appearance result = Appearance::unclear;
  with_context(view, [&](const MotionContext& context) { result = appearance_of(context, 0, 0); });
  return result;
}

/// Returns the appearance of a feature in the middle, before a camera that rests.
Appearance appearance(const cv::Mat1b& then, cv::Point2f feature, const FeatureTrack& track,
                      bool is_pose_known = true) {
  View view;
  view.then = then;
  view.feature = feature;
  view.track = track;
  view.is_pose_known = is_pose_known;
  return appearance(view);
}

TEST(Appearance, IsWhatTheImageShowsAtBothPlaces) {
  const cv::Point2f at(40, 30);
  const cv::Mat1b another(60, 80, std::uint8_t{90});
  EXPECT_EQ(appearance(wall(2), at, {at + cv::Point2f(2, 0), true}), Appearance::moved);
  EXPECT_EQ(appearance(wall(0), at, {at + cv::Point2f(2, 0), true}), Appearance::at_static_place);
  EXPECT_EQ(appearance(wall(0.1), at, {at + cv::Point2f(0.1F, 0), true}), Appearance::fits);
  EXPECT_EQ(appearance(another, at, {at + cv::Point2f(2, 0), true}), Appearance::unclear);
}

TEST(Appearance, NeedsNoTrack) {
  const cv::Point2f at(40, 30);
  EXPECT_EQ(appearance(wall(0), at, {}), Appearance::at_static_place);
  EXPECT_EQ(appearance(wall(2), at, {}), Appearance::absent);
}

TEST(Appearance, ContradictsNoTrackAtTheBorder) {
  const cv::Point2f border(2, 30), at(40, 30);
  EXPECT_EQ(appearance(wall(0), border, {border + cv::Point2f(2, 0), true}), Appearance::moved);
  EXPECT_EQ(appearance(wall(0), at, {cv::Point2f(78, 30), true}), Appearance::moved);
  EXPECT_EQ(appearance(wall(0), border, {}), Appearance::unclear);
}

TEST(Appearance, IsUnclearWithoutAPose) {
  const cv::Point2f at(40, 30);
  EXPECT_EQ(appearance(wall(0), at, {at, true}, false), Appearance::unclear);
}

/// A person has come up to two pixels beside the feature: what lies in front of it does not count.
TEST(Appearance, IsNotThatOfWhoPassesBeside) {
  View view;
  view.then = wall(0);
  view.then.colRange(0, 39).setTo(250);
  view.track = {cv::Point2f(43, 30), true};  // follows the person
  EXPECT_NE(appearance(view), Appearance::at_static_place);
  view.depth_m.colRange(0, 39).setTo(1.5F);
  EXPECT_EQ(appearance(view), Appearance::at_static_place);
}

TEST(Appearance, IsAtThePlaceOfTheSurfacesDepth) {
  View view;
  view.camera_shift_m = 0.015;  // two pixels
  view.then = wall(2);
  EXPECT_EQ(appearance(view), Appearance::at_static_place);
  view.depth_m.colRange(38, 43).setTo(0);  // a gap, with the wall around it
  EXPECT_EQ(appearance(view), Appearance::at_static_place);
  view.depth_m.setTo(8);
  EXPECT_EQ(appearance(view), Appearance::absent);
}

/// Without depth, any place on the segment may be the static one, and none is known without a
/// track.
TEST(Appearance, IsAtThePlaceNearestToTheTrackWithoutDepth) {
  View view;
  view.camera_shift_m = 0.015;
  view.then = wall(2);
  view.depth_m.setTo(0);
  view.track = {cv::Point2f(42, 30), true};
  EXPECT_EQ(appearance(view), Appearance::at_static_place);
  view.track.is_found = false;
  EXPECT_EQ(appearance(view), Appearance::unclear);
  view.then = wall(0);  // as the far end
  EXPECT_EQ(appearance(view), Appearance::at_static_place);
}

/// At an edge of depth, the feature may be at any depth of its interval.
TEST(Appearance, IsNotMovedWhereADepthOfTheIntervalExplainsTheTrack) {
  View view;
  view.camera_shift_m = 0.015;
  view.then = wall(4);
  view.track = {cv::Point2f(44, 30), true};  // as a point at 1.5 m
  EXPECT_EQ(appearance(view), Appearance::moved);
  view.depth_m.colRange(0, 38).setTo(1.5F);
  EXPECT_NE(appearance(view), Appearance::moved);
}

TEST(Appearance, IsUnclearBehindTheCamera) {
  View view;
  view.then = wall(2);
  view.track = {cv::Point2f(42, 30), true};
  with_context(view, [](const MotionContext& context) {
    context.measured.baselines[0].pose.pose.translation = {0, 0, -4};
    EXPECT_EQ(appearance_of(context, 0, 0), Appearance::unclear);
  });
}

/// A track may fail where the wall is plain to see.
TEST(MotionMeasurement, IsQuietWhereTheImageShowsTheFeatureStill) {
  View view;
  view.then = wall(0);
  for (const bool is_tracked : {false, true}) {
    view.track = {cv::Point2f(45, 30), is_tracked};
    with_context(view, [](const MotionContext& context) {
      measure_motions(context);
      EXPECT_EQ(context.measured.motions[0].evidence, MotionEvidence::quiet);
    });
  }
  view.then = wall(5);
  with_context(view, [](const MotionContext& context) {
    measure_motions(context);
    EXPECT_EQ(context.measured.motions[0].evidence, MotionEvidence::seed);
  });
}

/// Returns what is known of a feature that was not tracked.
MotionEvidence evidence(const View& view, bool is_beside_object = false) {
  MotionEvidence result = MotionEvidence::unknown;
  with_context(view, [&](const MotionContext& context) {
    context.measured.motions[0].is_beside_object = is_beside_object;
    measure_motions(context);
    result = context.measured.motions[0].evidence;
  });
  return result;
}

/// What would have been in view, and was not, has come.
TEST(MotionMeasurement, IsASeedWhereTheLastFrameHadShownTheFeature) {
  View view;
  view.then = wall(5);
  EXPECT_EQ(evidence(view), MotionEvidence::seed);
  EXPECT_EQ(evidence(view, true), MotionEvidence::unknown);
  view.depth_then_m.setTo(2.85F);  // something hid it
  EXPECT_EQ(evidence(view), MotionEvidence::unknown);
  view.depth_then_m.setTo(2.95F);
  EXPECT_EQ(evidence(view), MotionEvidence::seed);
  view.depth_then_m.setTo(5);
  EXPECT_EQ(evidence(view), MotionEvidence::seed);
  view.depth_then_m.setTo(0);
  EXPECT_EQ(evidence(view), MotionEvidence::unknown);
  view.depth_then_m.setTo(3);
  view.depth_m.setTo(0);
  EXPECT_EQ(evidence(view), MotionEvidence::unknown);
  view.depth_m.setTo(3);
  view.then = wall(0);
  EXPECT_EQ(evidence(view), MotionEvidence::quiet);
}

/// The place in the last frame is that of the camera then.
TEST(MotionMeasurement, LooksAtTheStaticPlaceForWhatHidTheFeature) {
  View view;
  view.then = wall(5);
  view.camera_shift_m = 0.075;  // ten pixels
  view.depth_then_m.col(50).setTo(2);
  EXPECT_EQ(evidence(view), MotionEvidence::unknown);
  view.depth_then_m.setTo(3);
  view.depth_then_m.col(40).setTo(2);
  EXPECT_EQ(evidence(view), MotionEvidence::seed);
}

/// The depth in the last frame is compared with the one that the feature had then.
TEST(MotionMeasurement, KnowsHowDeepAFeatureWasBeforeTheCameraMoved) {
  View view;
  view.then = wall(5);
  view.camera_approach_m = 0.5;
  view.depth_then_m.setTo(3.5);
  EXPECT_EQ(evidence(view), MotionEvidence::seed);
  view.depth_then_m.setTo(3.2F);  // nearer than the wall was
  EXPECT_EQ(evidence(view), MotionEvidence::unknown);
  view.camera_approach_m = -3.5;  // it was behind the camera
  EXPECT_EQ(evidence(view), MotionEvidence::unknown);
}

}  // namespace
}  // namespace dynfilter::detail
