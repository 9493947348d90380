// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Static weights are probabilities, on scenes that they were not fitted to.

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include <opencv2/features2d.hpp>

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/evaluation/reliability.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "lab/scenes/scene_levels.hpp"

namespace dynfilter {
namespace {

using DepthRule = Pipeline<MaskCuller, DepthCompensator>;

DepthRule depth_rule() { return DepthRule{MaskCuller(), DepthCompensator()}; }

/// Scene of a size of its own: motion needs the resolution that the weights were fitted at.
SyntheticScene scene_of(const char* level, std::uint64_t seed, const cv::Size& size) {
  SyntheticSceneOptions options = scene_level(level, seed);
  options.image_size = size;
  return SyntheticScene(options);
}

std::vector<cv::KeyPoint> features_of(const SyntheticFrame& rendered) {
  std::vector<cv::KeyPoint> keypoints;
  cv::ORB::create(2000)->detect(rendered.frame.image, keypoints);
  return keypoints;
}

/// 1 - score, which is what a label says without calibration.
std::vector<float> uncalibrated(const FeatureLabels& labels) {
  std::vector<float> weights;
  for (const FeatureLabel& label : labels) weights.push_back(1.0F - label.score);
  return weights;
}

TEST(WeightCalibration, HoldsForRuleDepthOnOtherScenes) {
  WeightReliability calibrated, raw;
  for (const char* level : {"medium", "hard", "stale_3", "furniture", "desk"}) {
    for (const std::uint64_t seed : {101U, 102U}) {
      const SyntheticScene scene = scene_of(level, seed, {320, 240});
      for (int i = 10; i < scene.size(); i += 100) {
        const SyntheticFrame frame = scene.render(i);
        const std::vector<cv::KeyPoint> keypoints = features_of(frame);
        const FeatureLabels labels =
            depth_rule().apply(frame.frame, frame.poor_segmentation, keypoints);
        calibrated +=
            score_weights(keypoints, labels, static_weights(labels), frame.true_segmentation);
        raw += score_weights(keypoints, labels, uncalibrated(labels), frame.true_segmentation);
      }
    }
  }
  ASSERT_GT(calibrated.suspected.count(), 3000U);
  EXPECT_LT(*calibrated.all.expected_calibration_error(), 0.05);
  EXPECT_LT(*calibrated.suspected.expected_calibration_error(), 0.05);
  EXPECT_GT(*raw.suspected.expected_calibration_error(), 0.1);  // the bound above can be missed
}

TEST(WeightCalibration, HoldsForWhatMovesOnOtherScenes) {
  WeightReliability sum;
  for (const char* level : {"sitting", "carried", "medium"}) {
    const SyntheticScene scene = scene_of(level, 101, {640, 480});
    const CameraParameters camera = scene.camera();
    MotionState state;
    const MotionJudge judge({camera.fx, camera.fy, camera.cx, camera.cy}, state);
    Workspace workspace;
    for (int i = 0; i < 15; ++i) {
      const SyntheticFrame frame = scene.render(i);
      const std::vector<cv::KeyPoint> keypoints = features_of(frame);
      FeatureLabels labels = depth_rule().apply(frame.frame, frame.poor_segmentation, keypoints);
      judge({frame.frame, frame.poor_segmentation, keypoints}, labels, workspace);
      Segmentation moving;
      moving.image_size = frame.moving_mask.size();
      moving.instances = {Instance::from_image_mask(frame.moving_mask)};
      sum += score_weights(keypoints, labels, static_weights(labels), moving);
    }
  }
  ASSERT_GT(sum.suspected.count(), 3000U);
  EXPECT_LT(*sum.all.expected_calibration_error(), 0.05);
}

}  // namespace
}  // namespace dynfilter
