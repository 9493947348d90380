// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/motion_measurement.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "motion/motion_labels.hpp"

namespace dynfilter::detail {
namespace {

constexpr double frame_s = 1 / 30.0;

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
  double camera_shift_m = 0;  // a point 3 m away shifts by 400 pixels a metre, over 3
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
  measured.baselines[0].pose.pose.translation = {view.camera_shift_m, 0, 0};
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
  EXPECT_EQ(appearance(wall(0), at, {}), Appearance::at_static_place);
  EXPECT_EQ(appearance(wall(2), at, {}), Appearance::absent);
  EXPECT_EQ(appearance(wall(0), at, {at, true}, false), Appearance::unclear);  // without a pose
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

/// Tells whether a feature becomes dynamic that has 24 features around it, so many of which are
/// believed to move.
bool is_filled(const FeatureMotion& motion, int dynamic_around) {
  const PinholeCamera camera{400, 400, 160, 120};
  std::vector<cv::KeyPoint> keypoints = {{160, 120, 7}};
  std::vector<FeatureMotion> motions = {motion};
  MotionMeasurement measured;
  measured.beliefs = {0};
  for (int i = 0; i < 25; ++i) {
    if (i == 12) continue;
    const bool moves = static_cast<int>(motions.size()) <= dynamic_around;
    keypoints.emplace_back(cv::Point2f(cv::Point(150 + 5 * (i % 5), 110 + 5 * (i / 5))), 7.0F);
    FeatureMotion other;
    other.is_tracked[0] = true;
    other.evidence = moves ? MotionEvidence::supported : MotionEvidence::quiet;
    motions.push_back(other);
    measured.beliefs.push_back(moves ? 10 : -10);
  }
  measured.motions = motions;
  FrameView frame;
  frame.image = cv::Mat1b(240, 320, std::uint8_t{0});
  const FilterInput input{frame, {}, keypoints};
  const MotionJudgeOptions options;
  MotionMemory memory;
  memory.beliefs.emplace(options.belief);
  Workspace workspace;
  decide_features({input, camera, options, false, memory, measured, workspace});
  return measured.is_moving[0] != 0;
}

TEST(MotionFill, TakesUnclearFeaturesBetweenThoseThatMove) {
  FeatureMotion tracked, with_depth;
  tracked.is_tracked[0] = true;
  tracked.ratio = 0.5F;
  with_depth.depth_m = 2;
  for (const FeatureMotion& unclear : {tracked, with_depth}) {
    EXPECT_TRUE(is_filled(unclear, 24));
    EXPECT_TRUE(is_filled(unclear, 16));
    EXPECT_FALSE(is_filled(unclear, 14));
    EXPECT_FALSE(is_filled(unclear, 0));
  }
  tracked.ratio = 0.2F;  // it is where a static one would be
  EXPECT_FALSE(is_filled(tracked, 24));
  EXPECT_FALSE(is_filled(FeatureMotion(), 24));  // nothing is known of it
}

/// Returns the mask of an object in the columns 20 to 49 and the rows 40 to 79.
Segmentation one_object(cv::Size image_size) {
  Segmentation masks;
  masks.image_size = image_size;
  masks.instances.emplace_back();
  masks.instances[0].mask = cv::Mat1b(40, 30, std::uint8_t{255});
  masks.instances[0].mask_origin = {20, 40};
  masks.instances[0].box = {20, 40, 30, 40};
  return masks;
}

/// Who was still until now tells the camera's motion, if need be. What was removed for no object
/// does not: a static mask moves with the camera, and a host's own stage knows better.
TEST(MotionMeasurement, SuspectsFeaturesByWhatTheyAreOn) {
  const PinholeCamera camera{400, 400, 160, 120};
  const std::vector<cv::KeyPoint> keypoints = {{35, 60, 7},  {55, 60, 7},  {70, 60, 7}, {80, 60, 7},
                                               {200, 60, 7}, {240, 60, 7}, {35, 50, 7}};
  FrameView frame;
  frame.image = cv::Mat1b(240, 320, std::uint8_t{0});
  const Segmentation masks = one_object(frame.image.size());
  FeatureLabels labels = Pipeline<MaskCuller>(MaskCuller()).apply(frame, masks, keypoints);
  labels.remove(2, 0, Reason::compensated, 0.8F);
  labels.remove(4, -1, Reason::custom, 1);
  labels.remove(5, -1, Reason::in_mask, 1);
  const FilterInput input{frame, masks, keypoints};
  const MotionJudgeOptions options;
  const InstanceVotes quiet{10, 10, 0, true, true};
  for (const int still_frames : {0, 3, 4, 9}) {
    MotionMemory memory;
    memory.beliefs.emplace().remember(std::vector<cv::KeyPoint>{{35, 50, 7}}, {2});  // moves
    memory.instances.emplace();
    for (int i = 0; i < still_frames; ++i) {
      memory.instances->begin_frame(masks);
      memory.instances->judge(0, quiet);
    }
    memory.instances->begin_frame(masks);
    MotionMeasurement measured;
    for (const cv::KeyPoint& keypoint : keypoints) {
      measured.baselines[0].tracks.push_back({keypoint.pt, true});
    }
    Workspace workspace;
    const MotionContext context{input, camera, options, true, memory, measured, workspace};
    measure_places(context);
    suspect_features(context, labels);
    const Suspicion of_object = still_frames >= 4 ? Suspicion::standing : Suspicion::moving;
    EXPECT_EQ(measured.suspicions,
              (std::vector<Suspicion>{of_object, of_object, Suspicion::compensated, Suspicion::none,
                                      Suspicion::foreign, Suspicion::foreign, Suspicion::moving}))
        << still_frames;
  }
}

}  // namespace
}  // namespace dynfilter::detail
