// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/relative_pose.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "lab/scenes/scene_levels.hpp"
#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

PinholeCamera pinhole(const CameraParameters& camera) {
  return {camera.fx, camera.fy, camera.cx, camera.cy};
}

/// Returns then_from_now of two poses of the camera in the world.
RelativePose motion_between(const CameraPose& now, const CameraPose& then) {
  return {then.rotation.t() * now.rotation,
          then.rotation.t() * (now.translation - then.translation)};
}

double rotation_between(const RelativePose& a, const RelativePose& b) {
  const cv::Matx33d turn = a.rotation * b.rotation.t();
  const cv::Vec3d axis(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  return std::asin(std::min(1.0, cv::norm(axis) / 2));
}

/// Observations of a rendered static room, exact but for noise, and of a mover that has a share of
/// the features and shifts by `mover_m` between the frames.
struct Case {
  PinholeCamera camera;
  RelativePose truth;
  std::vector<PoseObservation> observations;
};

Case rendered_case(double mover_share, const cv::Vec3d& mover_m, double noise_px, int now, int then,
                   std::uint64_t seed = 11, bool is_compact = true) {
  const SyntheticScene scene(scene_level("static", seed));
  const cv::Mat1f depth = scene.render(now).exact_depth_m;
  Case result{pinhole(scene.camera()), motion_between(scene.pose(now), scene.pose(then)), {}};
  cv::RNG random(7);
  for (int i = 0; i < 600; ++i) {
    const bool moves = i < 600 * mover_share;
    // The mover is at 1.2 m: a compact patch, or everywhere.
    const cv::Point pixel = moves && is_compact
                                ? cv::Point(random.uniform(200, 330), random.uniform(150, 330))
                                : cv::Point(random.uniform(0, 640), random.uniform(0, 480));
    const double depth_m = moves ? 1.2 : double{depth(pixel)};
    const cv::Point3d point = result.camera.point(pixel, depth_m);
    cv::Point3d then_point = result.truth * point;
    if (moves) then_point += cv::Point3d(mover_m[0], mover_m[1], mover_m[2]);
    const cv::Point2d noise(random.gaussian(noise_px), random.gaussian(noise_px));
    result.observations.push_back({point, *result.camera.project(then_point) + noise});
  }
  return result;
}

TEST(RelativePose, FindsExactRenderedPoses) {
  for (const int now : {3, 40, 111, 200}) {
    for (const int frames_back : {1, 3}) {
      const Case exact = rendered_case(0, {}, 0, now, now - frames_back);
      Workspace workspace;
      const RelativePoseEstimate estimate =
          RelativePoseEstimator(exact.camera).estimate(exact.observations, {}, {}, workspace);
      EXPECT_TRUE(estimate.is_trusted);
      EXPECT_EQ(estimate.observations, 600U);
      EXPECT_EQ(estimate.support, 1);
      EXPECT_LT(cv::norm(estimate.pose.translation - exact.truth.translation), 1e-7);
      EXPECT_LT(rotation_between(estimate.pose, exact.truth), 1e-7);
    }
  }
}

TEST(RelativePose, ResistsAnUnmaskedMoverWithAQuarterOfTheFeatures) {
  for (const cv::Vec3d& mover_m :
       {cv::Vec3d(0.01, 0, 0), cv::Vec3d(0, 0.03, 0), cv::Vec3d(0.02, 0.01, 0.02)}) {
    for (const std::uint64_t seed : {11U, 12U, 13U}) {
      const Case with_mover = rendered_case(0.25, mover_m, 0.1, 60, 59, seed);
      Workspace workspace;
      const RelativePoseEstimate estimate =
          RelativePoseEstimator(with_mover.camera)
              .estimate(with_mover.observations, {}, {}, workspace);
      EXPECT_TRUE(estimate.is_trusted);
      EXPECT_LT(cv::norm(estimate.pose.translation - with_mover.truth.translation), 1e-3)
          << mover_m << " seed " << seed;
    }
  }
}

/// Observations of a camera that stands: of twenty, so many are static, six are on a mover, and the
/// tracks of the others lead anywhere.
std::vector<PoseObservation> few_static_ones(const PinholeCamera& camera, int static_ones,
                                             std::uint64_t seed) {
  std::vector<PoseObservation> observations;
  cv::RNG random(seed);
  for (int i = 0; i < 600; ++i) {
    const bool is_lost = i % 20 >= static_ones + 6;
    const bool moves = i % 20 >= static_ones && !is_lost;
    const cv::Point pixel = moves ? cv::Point(random.uniform(180, 460), random.uniform(200, 480))
                                  : cv::Point(random.uniform(0, 640), random.uniform(0, 480));
    const cv::Point3d point = camera.point(pixel, moves ? 1.5 : random.uniform(2.0, 4.0));
    const cv::Point3d then = point + cv::Point3d(moves ? 0.02 : 0, 0, 0);
    const cv::Point2d noise(random.gaussian(0.25), random.gaussian(0.25));
    const double away_px = is_lost ? 8 : 0;
    const cv::Point2d wrong(random.uniform(-away_px, away_px), random.uniform(-away_px, away_px));
    observations.push_back({point, *camera.project(then) + noise + wrong});
  }
  return observations;
}

TEST(RelativePose, NeedsNoMajorityOfStaticFeatures) {
  const PinholeCamera camera{535, 539, 320, 248};
  int wrong_by_median = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto observations = few_static_ones(camera, 8, seed);
    Workspace workspace;
    const auto error_m = [&](const RelativePoseOptions& options) {
      const RelativePoseEstimator estimator(camera, options);
      return cv::norm(estimator.estimate(observations, {}, {}, workspace).pose.translation);
    };
    EXPECT_LT(error_m({}), 0.004) << seed;
    RelativePoseOptions median;
    median.quantile = 0.5;
    wrong_by_median += error_m(median) > 0.01 ? 1 : 0;
  }
  EXPECT_GT(wrong_by_median, 10);
}

TEST(RelativePose, IsNotTrustedWhereLessThanHalfAgree) {
  const PinholeCamera camera{535, 539, 320, 248};
  const RelativePoseEstimator estimator(camera);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Workspace workspace;
    const auto estimate = estimator.estimate(few_static_ones(camera, 7, seed), {}, {}, workspace);
    EXPECT_FALSE(estimate.is_trusted) << seed;
    EXPECT_GT(estimate.support, 0.3) << seed;
  }
}

TEST(RelativePose, HearsPlacesRatherThanFeatures) {
  // The mover has most of the features, in a part of the image.
  const Case rich = rendered_case(0.6, {0.03, 0, 0}, 0.1, 60, 59);
  Workspace workspace;
  const RelativePoseEstimate estimate =
      RelativePoseEstimator(rich.camera).estimate(rich.observations, {}, {}, workspace);
  EXPECT_TRUE(estimate.is_trusted);
  EXPECT_LT(cv::norm(estimate.pose.translation - rich.truth.translation), 1e-3);
}

TEST(RelativePose, NeedsAPriorWhereMostOfTheImageMoves) {
  const Case crowd = rendered_case(0.65, {0.03, 0, 0}, 0.1, 60, 59, 11, false);
  Workspace workspace;
  const RelativePoseEstimator estimator(crowd.camera);
  const RelativePoseEstimate captured = estimator.estimate(crowd.observations, {}, {}, workspace);
  EXPECT_GT(cv::norm(captured.pose.translation - crowd.truth.translation), 0.015);
  PosePrior prior;
  prior.pose = crowd.truth;
  prior.pose.translation += cv::Vec3d(0.002, -0.001, 0.001);
  prior.max_translation_m = 0.006;
  prior.is_trusted = true;
  const RelativePoseEstimate held = estimator.estimate(crowd.observations, {}, prior, workspace);
  EXPECT_TRUE(held.is_trusted);
  EXPECT_LE(cv::norm(held.pose.translation - prior.pose.translation), 0.006);
}

/// However many features move together, the few static ones tell the pose, and how large their
/// residuals are. The prior is 2.4 mm off.
TEST(RelativePose, IsMeasuredByTheFewStaticOnesWhereThePriorIsTrusted) {
  for (const double mover_share : {0.0, 0.5, 0.7, 0.8}) {
    const Case crowd = rendered_case(mover_share, {0.03, 0, 0}, 0.2, 60, 59, 11, false);
    PosePrior prior;
    prior.pose = crowd.truth;
    prior.pose.translation += cv::Vec3d(0.002, -0.001, 0.001);
    prior.max_translation_m = 0.006;
    prior.max_rotation_rad = 0.005;
    prior.is_trusted = true;
    Workspace workspace;
    const RelativePoseEstimate held =
        RelativePoseEstimator(crowd.camera).estimate(crowd.observations, {}, prior, workspace);
    EXPECT_TRUE(held.is_trusted);
    EXPECT_LT(cv::norm(held.pose.translation - crowd.truth.translation), 2e-3) << mover_share;
    EXPECT_LT(held.scale_px, 0.6) << mover_share;
  }
}

/// Where the observations tell a motion far beyond the limits, the nearest one within them may
/// still have a small scale, and is wrong all the same.
TEST(RelativePose, IsNotTrustedWhereTheObservationsContradictTheLimits) {
  const Case room = rendered_case(0, {}, 0.1, 60, 59);
  const RelativePoseEstimator estimator(room.camera);
  Workspace workspace;
  PosePrior prior;
  prior.pose = room.truth;
  prior.max_translation_m = 0.002;
  for (const double off_m : {0.001, 0.0025, 0.01}) {
    prior.pose.translation = room.truth.translation + cv::Vec3d(off_m, 0, 0);
    const auto estimate = estimator.estimate(room.observations, {}, prior, workspace);
    EXPECT_EQ(estimate.is_trusted, off_m < 0.01) << off_m;
    EXPECT_LT(estimate.scale_px, 3) << off_m;
    EXPECT_LE(cv::norm(estimate.pose.translation - prior.pose.translation), 0.002) << off_m;
  }
}

/// ORB-SLAM extracts corners on plain walls, too. Where seven of ten tracks are wrong by a pixel,
/// those with texture tell the pose.
TEST(RelativePose, IsToldByWellTexturedTracks) {
  Case room = rendered_case(0.15, {0.02, 0, 0}, 0.03, 60, 59);
  std::vector<PoseObservation>& observations = room.observations;
  cv::RNG random(5);
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const bool is_plain = i >= 90 && random.uniform(0, 10) < 7;  // the first 90 are the mover's
    observations[i].texture = is_plain ? 0.01 : 0.1;
    if (!is_plain) continue;
    observations[i].pixel_then += cv::Point2d(random.gaussian(1), random.gaussian(1));
  }
  Workspace workspace;
  const RelativePoseEstimator estimator(room.camera);
  const auto error_m = [&]() {
    return cv::norm(estimator.estimate(observations, {}, {}, workspace).pose.translation -
                    room.truth.translation);
  };
  EXPECT_LT(error_m(), 0.6e-3);
  for (PoseObservation& observation : observations) observation.texture = 0;
  EXPECT_GT(error_m(), 2e-3) << "nobody knows which tracks are good";
}

/// A fifth of the sample is taken for static: with their scale, a limit of 3.5 scales is 3 pixels.
/// What moves by more does not count, what moves by less does.
TEST(RelativePose, MeasuresTheScaleOfAFifthWhereThePriorIsTrusted) {
  for (const double mover_px : {2.7, 3.6}) {
    Case crowd = rendered_case(0, {}, 0.5, 60, 59);
    cv::RNG random(3);
    for (PoseObservation& observation : crowd.observations) {
      if (random.uniform(0, 10) < 2) continue;
      const double angle = random.uniform(0.0, 2 * CV_PI);
      observation.pixel_then = *crowd.camera.project(crowd.truth * observation.point_now_m) +
                               mover_px * cv::Point2d(std::cos(angle), std::sin(angle));
    }
    PosePrior prior;
    prior.pose = crowd.truth;
    prior.max_translation_m = 1e-9;  // the pose is known exactly
    prior.max_rotation_rad = 1e-9;
    prior.is_trusted = true;
    Workspace workspace;
    const double scale_px = RelativePoseEstimator(crowd.camera)
                                .estimate(crowd.observations, {}, prior, workspace)
                                .scale_px;
    const double median_px = mover_px < 3 ? mover_px : 0.5 * std::sqrt(2 * std::log(2));
    EXPECT_NEAR(scale_px, 1.4826 * median_px, 0.1) << mover_px;
  }
}

/// Observations of a camera that turns and moves by a part of the rendered motion.
Case partly_moved(double part) {
  Case result = rendered_case(0, {}, 0, 60, 57);
  result.truth.translation *= part;
  for (PoseObservation& observation : result.observations) {
    observation.pixel_then = *result.camera.project(result.truth * observation.point_now_m);
  }
  return result;
}

TEST(RelativePose, FindsTheTurnOfACameraThatOnlyTurns) {
  Workspace workspace;
  const Case turn = partly_moved(0), move = partly_moved(1);
  const RelativePoseEstimator estimator(turn.camera);
  RelativePose start;
  start.translation = {0.1, 0, 0};  // to be left out
  const RelativePoseEstimate found =
      estimator.estimate_turn(turn.observations, start, {}, workspace);
  EXPECT_TRUE(found.is_trusted);
  EXPECT_EQ(found.pose.translation, cv::Vec3d());
  EXPECT_LT(rotation_between(found.pose, turn.truth), 1e-7);
  EXPECT_GT(rotation_between(found.pose, {}), 1e-3);  // there is a turn to find

  // Where the camera moves as well, no turn fits.
  const RelativePoseEstimate wrong = estimator.estimate_turn(move.observations, {}, {}, workspace);
  EXPECT_EQ(wrong.pose.translation, cv::Vec3d());
  EXPECT_GT(wrong.scale_px, 4 * estimator.estimate(move.observations, {}, {}, workspace).scale_px);
}

TEST(RelativePose, IsNoTrustedTurnWhereAPriorSaysThatTheCameraMoves) {
  const RelativePoseEstimator estimator(partly_moved(0).camera);
  PosePrior prior;
  prior.is_trusted = true;
  prior.pose.translation = {1, 0, 0};
  Workspace workspace;
  EXPECT_FALSE(estimator.estimate_turn({}, {}, prior, workspace).is_trusted);
  EXPECT_TRUE(estimator.estimate({}, {}, prior, workspace).is_trusted);
  prior.max_translation_m = 2;
  EXPECT_TRUE(estimator.estimate_turn({}, {}, prior, workspace).is_trusted);
}

TEST(RelativePose, IsNotTrustedAmongTracksToNowhere) {
  Case nowhere = rendered_case(0, {}, 0, 60, 59);
  cv::RNG random(9);
  for (PoseObservation& observation : nowhere.observations) {
    observation.pixel_then = {random.uniform(0.0, 640.0), random.uniform(0.0, 480.0)};
  }
  Workspace workspace;
  const RelativePoseEstimator estimator(nowhere.camera);
  EXPECT_FALSE(estimator.estimate(nowhere.observations, {}, {}, workspace).is_trusted);
  nowhere.observations.resize(19);
  const RelativePoseEstimate few = estimator.estimate(nowhere.observations, {}, {}, workspace);
  EXPECT_FALSE(few.is_trusted);
  EXPECT_EQ(few.pose.translation, cv::Vec3d());
}

TEST(RelativePose, IsTheSameInAnyOrderAndWorkspace) {
  Case some = rendered_case(0.25, {0.01, 0, 0}, 0.3, 60, 57);
  const RelativePoseEstimator estimator(some.camera);
  Workspace workspace, other;
  const RelativePose first = estimator.estimate(some.observations, {}, {}, workspace).pose;
  std::reverse(some.observations.begin(), some.observations.end());
  std::rotate(some.observations.begin(), some.observations.begin() + 77, some.observations.end());
  EXPECT_EQ(estimator.estimate(some.observations, {}, {}, workspace).pose.rotation, first.rotation);
  EXPECT_EQ(estimator.estimate(some.observations, {}, {}, other).pose.translation,
            first.translation);
}

TEST(RelativePose, ComposesMotions) {
  const SyntheticScene scene(scene_level("static", 11));
  const RelativePose one = motion_between(scene.pose(9), scene.pose(8));
  const RelativePose other = motion_between(scene.pose(8), scene.pose(5));
  const RelativePose both = motion_between(scene.pose(9), scene.pose(5));
  EXPECT_LT(cv::norm((other * one).translation - both.translation), 1e-12);
  EXPECT_LT(cv::norm((other * one).rotation - both.rotation), 1e-12);
}

TEST(RelativePose, RefusesNonsense) {
  using Bad = std::invalid_argument;
  const PinholeCamera camera{500, 500, 320, 240};
  testing::expect_error<Bad>([] { RelativePoseEstimator{PinholeCamera()}; }, "fx = 0");
  RelativePoseOptions options;
  options.min_observations = 5;
  testing::expect_error<Bad>([&] { RelativePoseEstimator(camera, options); },
                             "min_observations = 5; want at least 6");
  options = {};
  options.min_support = 1.5;
  testing::expect_error<Bad>([&] { RelativePoseEstimator(camera, options); },
                             "min_support = 1.5; want a share from 0 to 1");
  options = {};
  options.quantile = 0.6;
  testing::expect_error<Bad>([&] { RelativePoseEstimator(camera, options); },
                             "quantile = 0.6; want a share from 0.1 to 0.5");
  options = {};
  options.min_scale_px = std::numeric_limits<double>::quiet_NaN();
  testing::expect_error<Bad>([&] { RelativePoseEstimator(camera, options); }, "min_scale_px = nan");
  const RelativePoseEstimator estimator(camera);
  Workspace workspace;
  const std::pair<PoseObservation, const char*> bad_observations[] = {
      {{{0, 0, -1}, {}}, "in front of the camera"},
      {{{0, 0, 1}, {}, -1}, "of texture -1; want"},
      {{{0, 0, 1}, {}, std::nan("")}, "of texture nan"}};
  for (const auto& [observation, message] : bad_observations) {
    const std::vector<PoseObservation> observations = {observation};
    testing::expect_error<Bad>([&] { estimator.estimate(observations, {}, {}, workspace); },
                               message);
  }
  PosePrior prior;
  prior.max_rotation_rad = 0;
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double number : {std::nan(""), infinity}) {
    PosePrior no_number;
    no_number.pose.translation[0] = number;
    testing::expect_error<Bad>([&] { estimator.estimate({}, {}, no_number, workspace); },
                               "a pose that is not finite");
    testing::expect_error<Bad>([&] { estimator.estimate({}, no_number.pose, {}, workspace); },
                               "a pose that is not finite");
  }
  testing::expect_error<Bad>([&] { estimator.estimate({}, {}, prior, workspace); },
                             "limits above 0");
}

}  // namespace
}  // namespace dynfilter
