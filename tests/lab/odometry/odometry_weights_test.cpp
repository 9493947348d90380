// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Weights of features in the reference odometry.

#include <cmath>
#include <cstddef>
#include <optional>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "bundle_adjustment.hpp"
#include "lab/odometry/odometry.hpp"
#include "pnp_ransac.hpp"
#include "support/odometry_scene.hpp"

namespace odometry {
namespace {

/// Tracks with the features on the true masks at one weight, or removed.
Odometry track_weighted(const Rendered& rendered, std::optional<float> weight_on_masks,
                        double min_weight) {
  OdometryOptions options;
  options.features = 800;
  options.min_weight = min_weight;
  Odometry odometry(rendered.camera, options);
  const OrbExtractor extractor(options.features);
  for (const SyntheticFrame& frame : rendered.frames) {
    cv::Mat grey, descriptors;
    std::vector<cv::KeyPoint> keypoints;
    cv::cvtColor(frame.frame.image, grey, cv::COLOR_BGR2GRAY);
    extractor.extract(grey, keypoints, descriptors);
    const dynfilter::Pipeline<dynfilter::MaskCuller> filter{dynfilter::MaskCuller()};
    const auto labels = filter.apply(frame.frame, frame.true_segmentation, keypoints);
    std::vector<float> weights;
    if (weight_on_masks) {
      for (const auto& label : labels) weights.push_back(label.removed ? *weight_on_masks : 1.0F);
    } else {
      dynfilter::keep_static(labels, keypoints, descriptors);
    }
    odometry.track(frame.frame, keypoints, descriptors, weights);
  }
  return odometry;
}

TEST(OdometryWeights, OfOneAreNoWeights) {
  const Odometry weighted = track_weighted(moving_frames(), 1.0F, 0.1);
  EXPECT_TRUE(are_equal(weighted.trajectory(), track(moving_frames(), false).trajectory()));
}

TEST(OdometryWeights, BelowTheMinimumAreRemoval) {
  const Odometry removed = track_weighted(moving_frames(), {}, 0.1);
  EXPECT_TRUE(
      are_equal(track_weighted(moving_frames(), 0.0F, 0.1).trajectory(), removed.trajectory()));
  EXPECT_TRUE(
      are_equal(track_weighted(moving_frames(), 0.09F, 0.1).trajectory(), removed.trajectory()));
}

TEST(OdometryWeights, LetSuspectedFeaturesDragLess) {
  const dynfilter::Trajectory& truth = moving_frames().truth;
  const double full_m = ate_m(track_weighted(moving_frames(), 1.0F, 0), truth);
  EXPECT_LT(ate_m(track_weighted(moving_frames(), 0.02F, 0), truth), 0.5 * full_m);
}

TEST(OdometryWeights, AreCheckedBeforeTheFrameCounts) {
  Odometry odometry(static_frames().camera);
  const dynfilter::FrameView& frame = static_frames().frames[0].frame;
  const std::vector<cv::KeyPoint> keypoints(3);
  const cv::Mat descriptors = cv::Mat::zeros(3, 32, CV_8UC1);
  for (const std::vector<float>& wrong :
       {std::vector<float>{1, 1}, {1, 1, -0.1F}, {1, 1, 1.1F}, {1, 1, NAN}}) {
    EXPECT_THROW(odometry.track(frame, keypoints, descriptors, wrong), std::invalid_argument);
  }
  const cv::Mat wrong_kind = cv::Mat::zeros(3, 32, CV_32FC1);
  for (const cv::Mat& wrong :
       {cv::Mat(), descriptors.rowRange(0, 2), descriptors.colRange(0, 8), wrong_kind}) {
    EXPECT_THROW(odometry.track(frame, keypoints, wrong), std::invalid_argument);
  }
  EXPECT_TRUE(odometry.trajectory().empty());
}

TEST(OdometryWeights, HaveAMinimumFromZeroToOne) {
  for (const double wrong : {-0.1, 1.1, static_cast<double>(NAN)}) {
    OdometryOptions options;
    options.min_weight = wrong;
    EXPECT_THROW(Odometry(static_frames().camera, options), std::invalid_argument);
  }
}

/// Matches with noise, so that the best pose depends on how much each one counts.
std::vector<PointMatch> noisy_matches(std::size_t count) {
  std::mt19937_64 random(5);
  std::vector<PointMatch> matches = exact_matches(test_pose(), count, 0);
  for (PointMatch& match : matches) {
    match.observation.pixel += Eigen::Vector2d(draw(random, -2, 2), draw(random, -2, 2));
  }
  return matches;
}

TEST(PoseRefinement, CountsAMatchOfWeightAQuarterFourTimesAsOnce) {
  std::vector<PointMatch> once = noisy_matches(40), repeated;
  for (std::size_t i = 0; i < once.size(); ++i) {
    PointMatch match = once[i];
    if (i % 2 == 0) match.observation.weight = 0.25;
    repeated.insert(repeated.end(), i % 2 == 0 ? 4 : 1, match);
  }
  Pose expected = test_pose(), pose = test_pose(), unweighted = test_pose();
  refine_pose(test_camera(), expected, once);
  refine_pose(test_camera(), pose, repeated);
  EXPECT_LT((pose.translation - expected.translation).norm(), 1e-6);
  for (PointMatch& match : repeated) match.observation.weight = 1;
  refine_pose(test_camera(), unweighted, repeated);
  EXPECT_GT((unweighted.translation - expected.translation).norm(), 1e-4);
}

TEST(PoseRefinement, FindsAnOutlierWhateverItsWeight) {
  std::vector<PointMatch> matches = exact_matches(test_pose(), 100, 15);
  for (std::size_t i = 0; i < 15; ++i) matches[i].observation.weight = 0.001;
  Pose pose = test_pose();
  EXPECT_EQ(refine_pose(test_camera(), pose, matches), 85U);
  EXPECT_FALSE(matches[0].is_inlier);
}

TEST(PnpRansac, CountsVotesByWeight) {
  std::vector<PointMatch> matches = exact_matches(test_pose(), 80, 40);
  for (PointMatch& match : matches) match.observation.weight = 0.25;
  EXPECT_TRUE(pnp_ransac(test_camera(), matches, 10, 1).has_value());
  EXPECT_FALSE(pnp_ransac(test_camera(), matches, 11, 1).has_value());
}

TEST(BundleAdjustment, CountsAnObservationOfWeightAHalfTwiceAsOnce) {
  const PinholeCamera camera = test_camera();
  Bundle once, twice;
  const std::vector<PointMatch> matches = noisy_matches(60);
  once.free_poses = 1;
  once.poses = {test_pose(), Pose()};
  std::mt19937_64 random(7);
  for (const PointMatch& match : matches) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Eigen::Vector3d seen = once.poses[k] * match.point;
      Observation observation;
      observation.pixel = camera.project(seen).head<2>() +
                          Eigen::Vector2d(draw(random, -1, 1), draw(random, -1, 1));
      observation.depth_m = seen.z();
      once.observations.push_back({k, once.points.size(), observation});
    }
    once.points.push_back(match.point);
  }
  twice = once;
  twice.observations.clear();
  for (BundleObservation seen : once.observations) {
    const bool is_halved = seen.point % 3 == 0 && seen.keyframe == 0;
    if (is_halved) seen.observation.weight = 0.5;
    twice.observations.insert(twice.observations.end(), is_halved ? 2 : 1, seen);
  }
  adjust_bundle(camera, once);
  adjust_bundle(camera, twice);
  EXPECT_LT((once.poses[0].translation - twice.poses[0].translation).norm(), 1e-9);
  EXPECT_LT((once.points[3] - twice.points[3]).norm(), 1e-9);
}

}  // namespace
}  // namespace odometry
