// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests of the reference odometry.

#include "lab/odometry/odometry.hpp"

#include <dynfilter/evaluation/rgbd_sequence.hpp>

#include "lab/odometry/frame_features.hpp"
#include "lab/odometry/odometry_scene.hpp"
#include "lab/odometry/orb_extractor.hpp"
#include "support/test.hpp"

namespace odometry {
namespace {

TEST(Odometry, TracksAStaticSceneToMillimetres) {
  const Odometry odometry = track(static_frames(), false);
  EXPECT_EQ(odometry.lost_frames(), 0U);
  EXPECT_EQ(odometry.trajectory().size(), static_frames().frames.size());
  EXPECT_LT(ate_m(odometry, static_frames().truth), 0.01);
}

TEST(OrbExtractor, CornersOfTheFirstOctaveAreWholePixels) {
  cv::Mat grey, descriptors;
  cv::cvtColor(static_frames().frames[0].frame.image, grey, cv::COLOR_BGR2GRAY);
  std::vector<cv::KeyPoint> keypoints;
  OrbExtractor(500).extract(grey, keypoints, descriptors);
  int whole = 0;
  for (const cv::KeyPoint& keypoint : keypoints) {
    if (keypoint.octave != 0) continue;
    EXPECT_EQ(keypoint.pt, cv::Point2f(cv::Point(keypoint.pt)));
    ++whole;
  }
  EXPECT_GT(whole, 50);
}

TEST(SlowOdometry, IsDeterministic) {
  const Odometry first = track(static_frames(), false);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const Odometry second = track(static_frames(), false);
  cv::setNumThreads(threads);
  EXPECT_TRUE(are_equal(first.trajectory(), second.trajectory()));
}

TEST(SlowOdometry, IsDraggedByPersonsUnlessTheirFeaturesAreRemoved) {
  const double with_persons = ate_m(track(moving_frames(), false), moving_frames().truth);
  const double without_persons = ate_m(track(moving_frames(), true), moving_frames().truth);
  EXPECT_LT(without_persons, 0.03);
  EXPECT_GT(with_persons, 4 * without_persons);
}

TEST(Odometry, ReportsBeingLostAndRelocalizes) {
  const Rendered& rendered = static_frames();
  HostOdometry odometry(rendered.camera);
  for (std::size_t i = 0; i < 6; ++i) odometry.track(rendered.frames[i].frame, {});
  dynfilter::FrameView dark = rendered.frames[6].frame;
  dark.image = cv::Mat::zeros(dark.image.size(), dark.image.type());
  const FrameResult lost = odometry.track(dark, {});
  EXPECT_EQ(lost.tracked, Tracked::lost);
  EXPECT_TRUE(lost.pose.has_value());
  EXPECT_EQ(odometry.lost_frames(), 1U);
  // So far ahead that the prediction is useless.
  const FrameResult found = odometry.track(rendered.frames[20].frame, {});
  EXPECT_EQ(found.tracked, Tracked::found);
  EXPECT_EQ(odometry.trajectory().size(), 8U);
  EXPECT_LT(ate_m(odometry, rendered.truth), 0.05);
}

TEST(Odometry, WaitsForAFrameWithFeaturesAndDepth) {
  const Rendered& rendered = static_frames();
  HostOdometry odometry(rendered.camera);
  dynfilter::FrameView frame = rendered.frames[0].frame;
  frame.depth = cv::Mat();
  EXPECT_EQ(odometry.track(frame, {}).tracked, Tracked::waiting);
  frame = rendered.frames[1].frame;
  frame.image = cv::Mat::zeros(frame.image.size(), frame.image.type());
  EXPECT_EQ(odometry.track(frame, {}).tracked, Tracked::waiting);
  EXPECT_FALSE(odometry.track(frame, {}).pose.has_value());
  EXPECT_TRUE(odometry.trajectory().empty());
  EXPECT_EQ(odometry.track(rendered.frames[2].frame, {}).tracked, Tracked::found);
  // Tracking continues without depth.
  frame = rendered.frames[3].frame;
  frame.depth = cv::Mat();
  EXPECT_EQ(odometry.track(frame, {}).tracked, Tracked::found);
}

/// Points at random pixels, each with a descriptor of its own, for a camera at rest.
class Wall {
 public:
  explicit Wall(std::size_t points) : depth_(480, 640, CV_32FC1, cv::Scalar(2)) {
    cv::RNG random(8);
    for (std::size_t i = 0; i < points; ++i) {
      const cv::Point pixel(random.uniform(20, 620), random.uniform(20, 460));
      depth_.at<float>(pixel) = random.uniform(1.5F, 3.0F);
      keypoints_.emplace_back(cv::Point2f(pixel), 31.0F, 0.0F, 1.0F, 0);
    }
    descriptors_ = cv::Mat(static_cast<int>(points), 32, CV_8UC1);
    random.fill(descriptors_, cv::RNG::UNIFORM, 0, 256);
  }

  /// Tracks a frame that shows the points of a range alone.
  FrameResult show(Odometry& odometry, int first, int end) {
    dynfilter::FrameView frame;
    frame.timestamp_s = ++frames_ / 30.0;
    frame.image = cv::Mat::zeros(depth_.size(), CV_8UC1);
    frame.depth = depth_;
    return odometry.track(frame, {keypoints_.begin() + first, keypoints_.begin() + end},
                          descriptors_.rowRange(first, end));
  }

 private:
  cv::Mat depth_, descriptors_;
  std::vector<cv::KeyPoint> keypoints_;
  int frames_ = 0;
};

constexpr dynfilter::Camera camera_before_wall{500, 500, 320, 240};

TEST(Odometry, MapsNearFeaturesAtOnceWhereItFollowsFew) {
  for (const int known : {90, 200}) {
    HostOdometry odometry(camera_before_wall);
    Wall wall(400);
    EXPECT_TRUE(wall.show(odometry, 0, known).is_keyframe);
    EXPECT_EQ(wall.show(odometry, 0, 400).is_keyframe, known < 100) << known;
  }
}

TEST(Odometry, RelocalizesByTheOldestKeyframeToo) {
  HostOdometry odometry(camera_before_wall);
  Wall wall(400);
  EXPECT_TRUE(wall.show(odometry, 0, 200).is_keyframe);
  bool has_second = false;
  for (int i = 0; i < 3; ++i) has_second = wall.show(odometry, 100, 400).is_keyframe;
  ASSERT_TRUE(has_second);
  EXPECT_EQ(wall.show(odometry, 200, 400).tracked, Tracked::found);
  // Only the first keyframe has these.
  const FrameResult again = wall.show(odometry, 0, 100);
  EXPECT_EQ(again.tracked, Tracked::found);
  EXPECT_GT(again.inliers, 90U);
}

TEST(PoseRefinement, JacobianIsTheDerivativeOfTheResidual) {
  const DisparityCamera camera = test_camera();
  const Eigen::Vector3d point(0.4, -0.3, 2.1);
  for (const double depth_m : {0.0, 2.0}) {
    Observation observation;
    observation.pixel = {400, 200};
    observation.depth_m = depth_m;
    observation.sigma_px = 1.2;
    observation.disparity_sigma_px = 0.5;
    const Pose pose = test_pose();
    const Eigen::Vector3d seen = pose * point;
    const auto jacobian = pose_jacobian(point_jacobian(camera, observation, seen), seen);
    for (int k = 0; k < 6; ++k) {
      constexpr double step = 1e-6;
      const Twist change = step * Twist::Unit(k);
      const Eigen::Vector3d ahead = residual(camera, observation, moved(pose, change) * point);
      const Eigen::Vector3d behind = residual(camera, observation, moved(pose, -change) * point);
      const Eigen::Vector3d numeric = (ahead - behind) / (2 * step);
      EXPECT_LT((jacobian.col(k) - numeric).norm(), 1e-4) << "component " << k;
    }
  }
}

TEST(PoseRefinement, FindsThePoseAndTheOutliers) {
  std::vector<PointMatch> matches = exact_matches(test_pose(), 100, 15);
  Pose pose = test_pose();
  pose.translation[0] += 0.02;
  EXPECT_EQ(refine_pose(test_camera(), pose, matches), 85U);
  EXPECT_LT(cv::norm(pose.translation - test_pose().translation), 1e-6);
  EXPECT_FALSE(matches[0].is_inlier);
  EXPECT_TRUE(matches[99].is_inlier);
}

TEST(PoseRefinement, LeavesInliersInFrontOfTheCamera) {
  // Distant points want the camera beyond a near one, which is seen straight ahead.
  const DisparityCamera camera = test_camera();
  std::vector<PointMatch> matches(61);
  std::mt19937_64 random(4);
  Pose beyond;
  beyond.translation[2] = -0.3;
  for (PointMatch& match : matches) {
    match.observation.pixel = {draw(random, 0, 640), draw(random, 0, 480)};
    match.point =
        beyond.inverse() * camera.back_project(match.observation.pixel, draw(random, 30, 40));
  }
  matches[0].point = {0, 0, 0.2};
  matches[0].observation.pixel = {camera.cx, camera.cy};
  Pose pose;
  refine_pose(camera, pose, matches);
  EXPECT_TRUE(matches[0].is_inlier);
  EXPECT_LT(pose.translation[2], 0) << "it moves, but not so far";
  EXPECT_GT(pose.translation[2], -0.2);
}

TEST(PnpRansac, FindsThePoseAmongHalfOutliersWithoutAGuess) {
  std::vector<PointMatch> matches = exact_matches(test_pose(), 80, 40);
  const auto pose = pnp_ransac(test_camera(), matches, 20, 1);
  ASSERT_TRUE(pose.has_value());
  EXPECT_LT(cv::norm(pose->translation - test_pose().translation), 1e-3);
  EXPECT_FALSE(pnp_ransac(test_camera(), matches, 60, 1).has_value());
}

TEST(BundleAdjustment, RecoversPosesAndPoints) {
  const DisparityCamera camera = test_camera();
  const std::vector<PointMatch> matches = exact_matches(Pose(), 60, 0);
  Bundle bundle;
  bundle.free_poses = 1;
  bundle.poses = {test_pose(), Pose()};
  for (const PointMatch& match : matches) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Eigen::Vector3d seen = bundle.poses[k] * match.point;
      Observation observation;
      observation.pixel = camera.project(seen).head<2>();
      observation.depth_m = seen.z();
      bundle.observations.push_back({k, bundle.points.size(), observation});
    }
    bundle.points.push_back(match.point + Eigen::Vector3d(0.004, -0.003, 0.01));
  }
  bundle.poses[0].translation[1] += 0.01;
  adjust_bundle(camera, bundle);
  EXPECT_LT(cv::norm(bundle.poses[0].translation - test_pose().translation), 1e-5);
  EXPECT_LT((bundle.points[30] - matches[30].point).norm(), 1e-4);
}

using SlowOdometryOnRecordedData = dynfilter::testing::RecordedData;

TEST_F(SlowOdometryOnRecordedData, TracksFr1XyzToCentimetres) {
  const dynfilter::RgbdSequence sequence(data("tum_fr1_xyz_120"));
  HostOdometry odometry(sequence.camera());
  for (std::size_t i = 0; i < sequence.size(); ++i) odometry.track(sequence.read(i), {});
  EXPECT_EQ(odometry.lost_frames(), 0U);
  const auto truth = dynfilter::read_trajectory(*sequence.groundtruth_file());
  EXPECT_LT(ate_m(odometry, truth), 0.02);
}

// --- Parts ---------------------------------------------------------------------------------------

TEST(FeatureGrid, FindsTheFeaturesOfASquare) {
  cv::RNG random(3);
  const DisparityCamera camera{{}, {130, 100}};
  std::vector<Feature> features(400);
  for (Feature& feature : features) {  // some beyond the image
    feature.observation.pixel = {random.uniform(-20.0, 150.0), random.uniform(-20.0, 120.0)};
  }
  for (std::size_t i = 0; i < 20; ++i) {  // at whole pixels
    features[i].observation.pixel = features[i].observation.pixel.array().round();
  }
  const FeatureGrid grid(features, camera);
  std::size_t found_in_all = 0;
  for (int trial = 0; trial < 500; ++trial) {
    Eigen::Vector2d pixel(random.uniform(-30.0, 160.0), random.uniform(-30.0, 130.0));
    double radius_px = random.uniform(0.5, 40.0);
    if (trial % 5 == 0) {  // a feature lies exactly on the side
      radius_px = std::ceil(radius_px);
      pixel = features[static_cast<std::size_t>(trial % 20)].observation.pixel.array() + radius_px;
    }
    std::vector<std::size_t> found, expected;
    grid.find(pixel, radius_px, found);
    std::sort(found.begin(), found.end());
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Eigen::Vector2d away = features[i].observation.pixel - pixel;
      if (std::abs(away.x()) <= radius_px && std::abs(away.y()) <= radius_px) expected.push_back(i);
    }
    ASSERT_EQ(found, expected) << trial;
    found_in_all += found.size();
  }
  EXPECT_GT(found_in_all, 1000U);
}

TEST(MakeFeatures, UndoesTheDistortion) {
  dynfilter::FrameView frame;
  frame.image = cv::Mat(480, 640, CV_8UC1);
  const std::vector<cv::KeyPoint> keypoints = {{500, 400, 7}};
  const cv::Mat descriptors(1, 32, CV_8UC1, cv::Scalar(0));
  const dynfilter::Camera lens{500, 500, 320, 240, 0.1};
  const Observation seen =
      make_features(frame, keypoints, descriptors, lens, {10, 1})[0].observation;
  const cv::Point2d ideal = *lens.undistort({500, 400});
  EXPECT_EQ(seen.pixel, Eigen::Vector2d(ideal.x, ideal.y));
}

TEST(Huber, IsQuadraticUpToTheLimitAndLinearBeyond) {
  constexpr double limit = 6;
  for (const double squared : {0.0, 0.5, 3.0, 6.0}) {
    EXPECT_EQ(huber(squared, limit).cost, squared);
    EXPECT_EQ(huber(squared, limit).weight, 1);
  }
  // Linear in the residual: 2 * sqrt(limit) * residual - limit.
  EXPECT_NEAR(huber(24, limit).cost, 2 * std::sqrt(limit) * std::sqrt(24) - limit, 1e-12);
  EXPECT_NEAR(huber(24, limit).weight, 0.5, 1e-12);
}

TEST(Huber, WeighsByTheDerivativeOfTheCost) {
  for (double squared = 0.5; squared < 40; squared += 0.7) {
    const double step = 1e-6;
    const double slope =
        (huber(squared + step, 6).cost - huber(squared - step, 6).cost) / (2 * step);
    EXPECT_NEAR(huber(squared, 6).weight, slope, 1e-6) << squared;
  }
}

}  // namespace
}  // namespace odometry
