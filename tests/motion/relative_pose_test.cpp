// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/relative_pose.hpp"

#include "dynfilter/camera.hpp"
#include "dynfilter/detail/rotation.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

Camera without_distortion(const SequenceCamera& c) { return {c.fx, c.fy, c.cx, c.cy}; }

/// Returns then_from_now of two poses of the camera in the world.
Pose motion_between(const Pose& now, const Pose& then) { return then.inverse() * now; }

double rotation_between(const Pose& a, const Pose& b) {
  return cv::norm(detail::rotation_vector_of(a.rotation * b.rotation.t()));
}

/// Observations of a rendered static room, exact but for noise, and of a mover that has a share of
/// the features and shifts by `mover_m` between the frames.
struct Case {
  Camera camera;
  Pose truth;
  std::vector<PoseObservation> observations;
};

Case rendered_case(double mover_share, const cv::Vec3d& mover_m, double noise_px, int now, int then,
                   std::uint64_t seed = 11, bool is_compact = true) {
  const SyntheticScene scene(scene_level("static", seed));
  static std::map<std::pair<std::uint64_t, int>, cv::Mat1f> rendered;  // for all tests
  cv::Mat1f& depth = rendered[{seed, now}];
  if (depth.empty()) depth = scene.render(now).exact_depth_m;
  Case result{
      without_distortion(scene.camera()), motion_between(scene.pose(now), scene.pose(then)), {}};
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

TEST(Rotation, IsTheOneOfItsVector) {
  EXPECT_EQ(cv::norm(detail::rotation_vector_of(cv::Matx33d::eye())), 0);
  const cv::Vec3d vector(0.3, -0.2, 0.1);
  const cv::Vec3d back = detail::rotation_vector_of(detail::rotation_of(vector));
  EXPECT_LT(cv::norm(back - vector), 1e-12);
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

/// Observations of a camera that stands: of twenty, so many are static, six are on a mover, and the
/// tracks of the others lead anywhere.
std::vector<PoseObservation> few_static_ones(const Camera& lens, int static_ones,
                                             std::uint64_t seed) {
  std::vector<PoseObservation> observations;
  cv::RNG random(seed);
  for (int i = 0; i < 600; ++i) {
    const bool is_lost = i % 20 >= static_ones + 6;
    const bool moves = i % 20 >= static_ones && !is_lost;
    const cv::Point pixel = moves ? cv::Point(random.uniform(180, 460), random.uniform(200, 480))
                                  : cv::Point(random.uniform(0, 640), random.uniform(0, 480));
    const cv::Point3d point = lens.point(pixel, moves ? 1.5 : random.uniform(2.0, 4.0));
    const cv::Point3d then = point + cv::Point3d(moves ? 0.02 : 0, 0, 0);
    const cv::Point2d noise(random.gaussian(0.25), random.gaussian(0.25));
    const double away_px = is_lost ? 8 : 0;
    const cv::Point2d wrong(random.uniform(-away_px, away_px), random.uniform(-away_px, away_px));
    observations.push_back({point, *lens.project(then) + noise + wrong});
  }
  return observations;
}

TEST(RelativePose, NeedsNoMajorityOfStaticFeatures) {
  const Camera lens{535, 539, 320, 248};
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto observations = few_static_ones(lens, 8, seed);
    Workspace workspace;
    const RelativePoseEstimator estimator(lens);
    const auto estimate = estimator.estimate(observations, {}, {}, workspace);
    EXPECT_LT(cv::norm(estimate.pose.translation), 0.004) << seed;
  }
}

TEST(RelativePose, IsNotTrustedWhereLessThanHalfAgree) {
  const Camera lens{535, 539, 320, 248};
  const RelativePoseEstimator estimator(lens);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Workspace workspace;
    const auto estimate = estimator.estimate(few_static_ones(lens, 7, seed), {}, {}, workspace);
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

TEST(RelativePose, TurnsNoFartherThanThePriorAllows) {
  const Case room = rendered_case(0, {}, 0.2, 60, 57);
  PosePrior prior;
  prior.pose = {detail::rotation_of({0, 0, 0.05}) * room.truth.rotation, room.truth.translation};
  prior.max_translation_m = 1;
  Workspace workspace;
  const RelativePoseEstimate held =
      RelativePoseEstimator(room.camera).estimate(room.observations, {}, prior, workspace);
  EXPECT_FALSE(held.is_trusted);
  EXPECT_LE(rotation_between(held.pose, prior.pose), prior.max_rotation_rad);
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
  Pose start;
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
  const Pose first = estimator.estimate(some.observations, {}, {}, workspace).pose;
  std::reverse(some.observations.begin(), some.observations.end());
  std::rotate(some.observations.begin(), some.observations.begin() + 77, some.observations.end());
  EXPECT_EQ(estimator.estimate(some.observations, {}, {}, workspace).pose.rotation, first.rotation);
  EXPECT_EQ(estimator.estimate(some.observations, {}, {}, other).pose.translation,
            first.translation);
}

TEST(RelativePose, RefusesNonsense) {
  using Bad = std::invalid_argument;
  const Camera lens{500, 500, 320, 240};
  expect_error<Bad>([] { RelativePoseEstimator{Camera()}; }, "fx = 0");
  const RelativePoseEstimator estimator(lens);
  Workspace workspace;
  std::vector<PoseObservation> observations = {{{0, 0, -1}, {}}};
  expect_error<Bad>([&] { estimator.estimate(observations, {}, {}, workspace); },
                    "in front of the camera");
  PosePrior prior;
  prior.pose.translation[0] = std::nan("");
  expect_error<Bad>([&] { estimator.estimate({}, {}, prior, workspace); },
                    "a pose that is not finite");
  prior = {};
  prior.max_rotation_rad = 0;
  expect_error<Bad>([&] { estimator.estimate({}, {}, prior, workspace); }, "limits above 0");
}

}  // namespace
}  // namespace dynfilter::testing
