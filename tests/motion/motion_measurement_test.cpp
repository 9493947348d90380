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
  EXPECT_EQ(measured.baselines[1].is_known, measured.baselines[1].pose.is_trusted);
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

TEST(MotionMeasurement, SaysNothingOfAFeatureWithoutTrack) {
  const PinholeCamera camera{400, 400, 320, 240};
  const std::vector<cv::KeyPoint> keypoints = {{100, 100, 7}, {200, 100, 7}};
  const FilterInput input{{}, {}, keypoints};
  MotionMemory memory;
  MotionMeasurement measured;
  measured.ideal = {{100, 100}, {200, 100}};
  measured.depths.resize(2);
  measured.baselines[0].is_known = true;
  measured.baselines[0].duration_s = frame_s;
  measured.baselines[0].tracks = {{{100, 100}, true}, {{200, 100}, false}};
  Workspace workspace;
  const MotionJudgeOptions options;
  const MotionContext context{input, camera, options, false, memory, measured, workspace};
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

/// Returns what a frame shows of a feature over the short baseline, by a camera that rests.
Appearance appearance(const cv::Mat1b& then, cv::Point2f feature, const FeatureTrack& track,
                      bool is_pose_known = true) {
  const PinholeCamera camera{400, 400, 40, 30};
  const std::vector<cv::KeyPoint> keypoints = {{feature, 7}};
  FrameView frame;
  frame.depth = cv::Mat1f(60, 80, 3.0F);
  const FilterInput input{frame, {}, keypoints};
  MotionMemory memory;
  const FeatureTracker tracker;
  tracker.build(wall(0), memory.now.pyramid);
  tracker.build(then, memory.past[0].pyramid);
  MotionMeasurement measured;
  measured.ideal = {feature};
  measured.depths.resize(1);
  measured.baselines[0].is_known = is_pose_known;
  measured.baselines[0].tracks = {track};
  Workspace workspace;
  const MotionJudgeOptions options;
  return appearance_of({input, camera, options, false, memory, measured, workspace}, 0, 0);
}

TEST(Appearance, IsWhatTheImageShowsAtBothPlaces) {
  const cv::Point2f at(40, 30);
  const cv::Mat1b another(60, 80, std::uint8_t{90});
  EXPECT_EQ(appearance(wall(2), at, {at + cv::Point2f(2, 0), true}), Appearance::moved);
  EXPECT_EQ(appearance(wall(0), at, {at + cv::Point2f(2, 0), true}), Appearance::still);
  EXPECT_EQ(appearance(wall(0.1), at, {at + cv::Point2f(0.1F, 0), true}), Appearance::fits);
  EXPECT_EQ(appearance(another, at, {at + cv::Point2f(2, 0), true}), Appearance::unclear);
}

TEST(Appearance, NeedsNoTrack) {
  const cv::Point2f at(40, 30);
  EXPECT_EQ(appearance(wall(0), at, {}), Appearance::still);
  EXPECT_EQ(appearance(wall(2), at, {}), Appearance::unclear);
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

}  // namespace
}  // namespace dynfilter::detail
