// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features between others that move.

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "motion/motion_labels.hpp"
#include "motion/motion_measurement.hpp"

namespace dynfilter::detail {
namespace {

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

/// Tells whether a new feature is suspected that has 24 features around it, so many of which are
/// believed to move. `behind_m`: how far it is behind them.
bool is_suspected(int dynamic_around, double behind_m = 0) {
  const PinholeCamera camera{400, 400, 160, 120};
  MotionMemory memory;
  memory.beliefs.emplace();
  MotionMeasurement measured;
  std::vector<cv::KeyPoint> keypoints, before;
  std::vector<double> beliefs;
  for (int i = 0; i < 25; ++i) {
    const cv::Point2f place(cv::Point(150 + 5 * (i % 5), 110 + 5 * (i / 5)));
    keypoints.emplace_back(place, 7.0F);
    measured.baselines[0].tracks.push_back({place, true});
    if (i == 12) continue;
    before.emplace_back(place, 7.0F);
    beliefs.push_back(static_cast<int>(beliefs.size()) < dynamic_around ? 2 : -2);
  }
  memory.beliefs->remember(before, beliefs);
  FrameView frame;
  frame.image = cv::Mat1b(240, 320, std::uint8_t{0});
  frame.depth = cv::Mat1f(240, 320, 2.0F);
  frame.depth.at<float>(120, 160) = static_cast<float>(2 + behind_m);
  const FilterInput input{frame, {}, keypoints};
  const MotionJudgeOptions options;
  Workspace workspace;
  const FeatureLabels labels =
      Pipeline<MaskCuller>(MaskCuller()).apply(frame, Segmentation(), keypoints);
  const MotionContext context{input, camera, options, false, memory, measured, workspace};
  measure_places(context);
  suspect_features(context, labels);
  return measured.suspicions[12] == Suspicion::moving;
}

/// A thing that comes nearer shows new features. They do not tell the camera's motion.
TEST(MotionFill, SuspectsNewFeaturesBetweenThoseBelievedToMove) {
  EXPECT_TRUE(is_suspected(24));
  EXPECT_TRUE(is_suspected(16));
  EXPECT_FALSE(is_suspected(14));
  EXPECT_FALSE(is_suspected(0));
  EXPECT_FALSE(is_suspected(24, 0.5));  // it is on the wall behind the thing
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

/// An object with a mask may hide what is near it, and only what is near it.
TEST(MotionMeasurement, KnowsWhatIsBesideADynamicObject) {
  const PinholeCamera camera{400, 400, 160, 120};
  std::vector<cv::KeyPoint> keypoints;
  for (const int x : {40, 69, 109, 120}) keypoints.emplace_back(cv::Point(x, 60), 7.0F);
  FrameView frame;
  frame.image = cv::Mat1b(240, 320, std::uint8_t{0});
  Segmentation masks = one_object(frame.image.size());
  for (const int class_id : {0, 56}) {
    masks.instances[0].class_id = class_id;
    MotionMemory memory;
    memory.beliefs.emplace();
    memory.instances.emplace().begin_frame(masks);
    MotionMeasurement measured;
    measured.baselines[0].tracks.resize(keypoints.size());
    const FeatureLabels labels = Pipeline<MaskCuller>(MaskCuller()).apply(frame, masks, keypoints);
    const FilterInput input{frame, masks, keypoints};
    const MotionJudgeOptions options;
    Workspace workspace;
    const MotionContext context{input, camera, options, true, memory, measured, workspace};
    measure_places(context);
    suspect_features(context, labels);
    const bool is_person = class_id == 0;
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      EXPECT_EQ(measured.motions[i].is_beside_object, is_person && i < 3) << i;
    }
    // A smaller distance, and nothing remains from the last frame.
    MotionJudgeOptions near = options;
    near.beside_object_px = 25;
    const MotionContext nearer{input, camera, near, true, memory, measured, workspace};
    measure_places(nearer);
    suspect_features(nearer, labels);
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      EXPECT_EQ(measured.motions[i].is_beside_object, is_person && i < 2) << i;
    }
  }
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
