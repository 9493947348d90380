// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// DynaSLAM's geometry in src/lab/rules: on frames made by hand, and on hostile sequences.

#include "lab/rules/depth_consistency.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/filter_case.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

const PinholeCamera wall_camera{120, 120, 80, 60};

/// A frame of 160x120 pixels with a grid of features, by a camera that rests.
struct Scene {
  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::Point2f> features;
  std::optional<RelativePose> pose = RelativePose();

  FeatureLabels judged_by(peers::DepthConsistency& rule) const {
    FeatureLabels labels(features.size(), segmentation);
    rule.judge({frame, segmentation, features}, pose, labels);
    return labels;
  }
};

/// Wall at 4 m that fills the image.
Scene wall() {
  Scene scene;
  scene.frame.depth = cv::Mat(120, 160, CV_32FC1, cv::Scalar(4));
  for (int y = 4; y < 120; y += 8) {
    for (int x = 4; x < 160; x += 8) {
      scene.features.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
  return scene;
}

/// Verdicts on the frame after five keyframes of the wall, which are every second frame.
FeatureLabels after_walls(const Scene& scene) {
  peers::DepthConsistency rule(wall_camera);
  for (int k = 0; k < 9; ++k) EXPECT_EQ(wall().judged_by(rule).statistics().removed(), 0U);
  return scene.judged_by(rule);
}

TEST(DepthConsistency, RemovesWhatCameBeforeTheWall) {
  Scene scene = wall();
  const cv::Rect person(50, 30, 60, 60);
  scene.frame.depth(person).setTo(2);
  const FeatureLabels labels = after_walls(scene);
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    const cv::Point2f at = scene.features[i];
    EXPECT_TRUE(labels.is_removed(i) || !person.contains(at)) << at;
    const cv::Rect dilated(34, 14, 92, 92);
    EXPECT_TRUE(!labels.is_removed(i) || dilated.contains(at)) << at;
  }
}

TEST(DepthConsistency, KeepsTheWallWhatIsBehindItAndThinThings) {
  EXPECT_EQ(after_walls(wall()).statistics().removed(), 0U);
  Scene behind = wall();
  behind.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(6);
  EXPECT_EQ(after_walls(behind).statistics().removed(), 0U);
  Scene thin = wall();  // no window lies on it
  thin.frame.depth(cv::Rect(70, 0, 20, 120)).setTo(2);
  EXPECT_EQ(after_walls(thin).statistics().removed(), 0U);
}

TEST(DepthConsistency, GapMustExceedSixTenthsOfAMetre) {
  const auto removed_at = [](double depth_m) {
    Scene scene = wall();
    scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(depth_m);
    return after_walls(scene).statistics().removed();
  };
  EXPECT_EQ(removed_at(3.41), 0U);
  EXPECT_GT(removed_at(3.39), 0U);
}

TEST(DepthConsistency, BeginsWithFiveKeyframesAndForgetsThemWithoutAPose) {
  Scene scene = wall();
  scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(2);
  peers::DepthConsistency rule(wall_camera);
  for (int k = 0; k < 8; ++k) EXPECT_EQ(wall().judged_by(rule).statistics().removed(), 0U);
  EXPECT_EQ(scene.judged_by(rule).statistics().removed(), 0U) << "makes the fifth";
  EXPECT_GT(scene.judged_by(rule).statistics().removed(), 0U);
  scene.pose.reset();
  EXPECT_EQ(scene.judged_by(rule).statistics().removed(), 0U);
  scene.pose.emplace();
  EXPECT_EQ(scene.judged_by(rule).statistics().removed(), 0U) << "forgotten";
}

TEST(DepthConsistency, ComparesWithTheFarthestKeyframes) {
  std::vector<peers::DepthConsistency::Keyframe> all(7);
  for (std::size_t k = 0; k < 7; ++k) {
    all[k].from_now.translation = {0.1 * static_cast<double>(7 - k), 0, 0};
  }
  // A turn, the largest, adds 0.3 to 0.7 * 0.15 / 0.7.
  all[6].from_now.translation = {0.15, 0, 0};
  all[6].from_now.rotation =
      cv::Matx33d(std::cos(0.5), -std::sin(0.5), 0, std::sin(0.5), std::cos(0.5), 0, 0, 0, 1);
  const auto chosen = peers::DepthConsistency::references(all);
  ASSERT_EQ(chosen.size(), 5U);
  const std::size_t expected[] = {0, 1, 2, 6, 3};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(chosen[k], &all[expected[k]]);
}

const cv::Size frame_size(97, 73);

/// Sequence of hostile frames: depths, boxes, masks and features anywhere; at times without depth,
/// without image or of another size.
struct HostileFrame {
  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::KeyPoint> keypoints;
};

std::vector<HostileFrame> hostile_frames(std::uint64_t seed) {
  ByteSource source(seed);
  std::vector<HostileFrame> frames(7);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    HostileFrame& one = frames[k];
    const cv::Size size =
        source.chance(10) ? cv::Size(source.between(1, 60), source.between(1, 60)) : frame_size;
    one.frame.timestamp_s = 0.1 * static_cast<double>(k);
    if (source.chance(95)) {
      const cv::Mat1b picture = texture({140, 100}, seed);
      one.frame.image =
          picture(cv::Rect({source.between(0, 9), source.between(0, 9)}, size)).clone();
    }
    const bool is_float = source.chance(50);
    if (source.chance(90)) one.frame.depth = arbitrary_depth(source, size, is_float);
    one.frame.metres_per_unit = 1.0 / 5000;
    if (is_float) one.frame.metres_per_unit = 0;
    one.segmentation.image_size = size;
    for (int i = source.between(0, 3); i > 0; --i) {
      one.segmentation.instances.push_back(arbitrary_instance(source, size));
    }
    one.keypoints = arbitrary_keypoints(source, size);
  }
  return frames;
}

TEST(DepthConsistency, AcceptsHostileSequencesAndKeepsWhatIsOutside) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    peers::DepthConsistency rule({80, 80, 48, 36}), again({80, 80, 48, 36});
    Workspace workspace, other_workspace;
    for (const HostileFrame& one : hostile_frames(seed)) {
      const FilterInput input{one.frame, one.segmentation, one.keypoints};
      FeatureLabels labels(one.keypoints.size(), one.segmentation), second = labels;
      ASSERT_NO_THROW(rule(input, labels, workspace)) << "seed " << seed;
      again(input, second, other_workspace);
      const cv::Rect image({0, 0}, one.segmentation.image_size);
      for (std::size_t i = 0; i < labels.size(); ++i) {
        const bool is_outside = !image.contains(input.features.pixel(i));
        ASSERT_FALSE(is_outside && labels.is_removed(i)) << "seed " << seed;
        ASSERT_EQ(labels.is_removed(i), second.is_removed(i)) << "seed " << seed;
      }
    }
  }
}

TEST(DepthConsistency, RefusesLabelsOfAnotherLength) {
  const HostileFrame one = hostile_frames(1)[0];
  FeatureLabels labels(one.keypoints.size() + 1, one.segmentation);
  Workspace workspace;
  peers::DepthConsistency rule(wall_camera);
  expect_error<std::invalid_argument>(
      [&] {
        rule({one.frame, one.segmentation, one.keypoints}, labels, workspace);
      },
      "labels made or reset for these features");
}

}  // namespace
}  // namespace dynfilter::testing
