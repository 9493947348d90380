// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The camera's motion where a wall is nearly all that is seen: a shift and a turn look alike there.
// Features lie on the wall and on things before it.

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_judge.hpp"
#include "dynfilter/motion/relative_pose.hpp"
#include "motion/motion_measurement.hpp"

namespace dynfilter::detail {
namespace {

constexpr double pose_wall_m = 5;
const cv::Size wall_image_size(640, 480);
const PinholeCamera pinhole{525, 525, 320, 240};

/// Group of features on a thing at one depth.
struct Thing {
  cv::Rect box;
  double depth_m = pose_wall_m;
  cv::Vec3d motion_m;  // from the frame before to this one, in the camera's axes
  Suspicion suspicion = Suspicion::none;
  int spacing_px = 12;
};

/// Features of a wall and of things before it, tracked with noise into the frame before.
class WallScene {
 public:
  WallScene(const RelativePose& truth, const std::vector<Thing>& things) : truth_(truth) {
    frame_.depth = cv::Mat(wall_image_size, CV_32FC1, cv::Scalar(pose_wall_m));
    for (const Thing& thing : things) frame_.depth(thing.box).setTo(thing.depth_m);
    // Below the wall nothing is measured.
    frame_.depth.rowRange(200, wall_image_size.height)
        .setTo(0, frame_.depth.rowRange(200, wall_image_size.height) == pose_wall_m);
    add({{40, 20, 560, 160}, pose_wall_m, {}, Suspicion::none, 16}, things);
    for (const Thing& thing : things) add(thing, {});
  }

  cv::Mat& depth() { return frame_.depth; }

  std::optional<PosePrior> prior;

  RelativePoseEstimate estimated(bool has_masks = true, const MotionJudgeOptions& options = {}) {
    measured_.suspicions = suspicions_;
    measured_.baselines[0].duration_s = 1 / 30.0;
    measured_.baselines[0].tracks = tracks_;
    const FilterInput input{frame_, {}, keypoints_};
    MotionMemory memory;
    memory.known = 2;
    memory.prior = prior;
    Workspace workspace;
    const MotionContext context{input, pinhole, options, has_masks, memory, measured_, workspace};
    measure_places(context);
    estimate_pose(context, RelativePoseEstimator(pinhole), 0);
    EXPECT_EQ(measured_.baselines[0].is_used, measured_.baselines[0].pose.is_trusted);
    return measured_.baselines[0].pose;
  }

 private:
  /// Adds the features of a thing that nothing else hides.
  void add(const Thing& thing, const std::vector<Thing>& before) {
    for (int y = thing.box.y + 5; y < thing.box.br().y - 4; y += thing.spacing_px) {
      for (int x = thing.box.x + 5; x < thing.box.br().x - 4; x += thing.spacing_px) {
        bool is_hidden = false;
        for (const Thing& other : before) is_hidden |= other.box.contains({x, y});
        if (is_hidden) continue;
        cv::Point3d then = pinhole.point(cv::Point2d(x, y), thing.depth_m) -
                           cv::Point3d(thing.motion_m[0], thing.motion_m[1], thing.motion_m[2]);
        const cv::Point2d place = *pinhole.project(truth_ * then);
        const cv::Point2f noise(static_cast<float>(random_.gaussian(0.1)),
                                static_cast<float>(random_.gaussian(0.1)));
        keypoints_.emplace_back(cv::Point2f(cv::Point(x, y)), 7.0F);
        tracks_.push_back({cv::Point2f(place) + noise, true});
        suspicions_.push_back(thing.suspicion);
      }
    }
  }

  RelativePose truth_;
  FrameView frame_;
  cv::RNG random_{5};
  std::vector<cv::KeyPoint> keypoints_;
  std::vector<FeatureTrack> tracks_;
  std::vector<Suspicion> suspicions_;
  MotionMeasurement measured_;
};

const Thing cart{{60, 200, 250, 200}, 1.9, {0.012, 0, 0}, Suspicion::none, 15};
const Thing standing_person{{400, 100, 120, 360}, 1.8, {}, Suspicion::standing, 8};

double error_m(const RelativePoseEstimate& estimate, const RelativePose& truth) {
  return cv::norm(estimate.pose.translation - truth.translation);
}

RelativePose moved(double z_m) {
  RelativePose move;
  move.translation = {0, 0, z_m};
  return move;
}

/// A cart before a wall looks as if the camera had moved by the cart's motion, and the wall allows
/// it. That a person who stands would then move is no proof, but a camera that only turns explains
/// more.
TEST(MotionPose, IsNotCapturedByACartWhereTheCameraRestsOrTurns) {
  RelativePose turn;
  turn.rotation = {std::cos(0.01), 0, std::sin(0.01), 0, 1, 0, -std::sin(0.01), 0, std::cos(0.01)};
  for (const RelativePose& truth : {RelativePose(), turn}) {
    WallScene scene(truth, {cart, standing_person});
    const RelativePoseEstimate estimate = scene.estimated();
    EXPECT_TRUE(estimate.is_trusted);
    EXPECT_EQ(error_m(estimate, truth), 0);
    EXPECT_LT(cv::norm(estimate.pose.rotation - truth.rotation), 1e-3);

    MotionJudgeOptions never;  // takes the last two poses
    never.min_agreement_gain = std::numeric_limits<double>::infinity();
    EXPECT_GT(error_m(scene.estimated(true, never), truth), 0.008);
    // Where no masks are known, most features may be on persons: no pose is taken for a turn.
    EXPECT_NE(error_m(scene.estimated(false), truth), 0);
  }
}

/// A camera that moves as well: a person who stands agrees with its true motion only.
TEST(MotionPose, IsNotCapturedByACartWhereAPersonStands) {
  RelativePose move;
  move.translation = {0.008, 0, 0};
  MotionJudgeOptions never;  // takes the last two poses
  never.min_agreement_gain = std::numeric_limits<double>::infinity();
  Thing person = standing_person;
  person.spacing_px = 12;
  WallScene scene(move, {cart, person});
  EXPECT_TRUE(scene.estimated().is_trusted);
  EXPECT_LT(error_m(scene.estimated(), move), 1e-3);
  EXPECT_GT(error_m(scene.estimated(true, never), move), 0.008);
  scene.prior = PosePrior{scene.estimated(true, never).pose, 0.02, 0.02, true};
  EXPECT_GT(error_m(scene.estimated(), move), 0.008) << "a trusted prior knows better";
}

/// Who stood until now may walk again: alone, he does not tell the camera's motion, nor against
/// what nobody suspects.
TEST(MotionPose, IsNotThatOfAStandingPersonAgainstTheWall) {
  const cv::Rect left_of_wall(0, 0, 450, 200), wall(0, 0, 640, 200);
  for (const cv::Rect& without_depth : {left_of_wall, wall}) {
    Thing starting = standing_person;
    starting.box = {380, 200, 240, 250};
    starting.spacing_px = without_depth == wall ? 16 : 15;
    starting.motion_m = {0, 0, -0.05};
    WallScene scene({}, {starting});
    scene.depth()(without_depth).setTo(0);
    EXPECT_EQ(scene.estimated().is_trusted, without_depth != wall);
    EXPECT_LT(error_m(scene.estimated(), {}), 0.005) << "his motion would make 50 mm";
  }
}

TEST(MotionPose, IsThatOfCompensatedFeaturesWhereOthersDoNotSuffice) {
  const RelativePose move = moved(0.02);
  WallScene scene(move, {{{30, 10, 590, 230}, 2.0, {}, Suspicion::compensated, 10},
                         {{30, 240, 590, 230}, 1.5, {}, Suspicion::compensated, 10}});
  const RelativePoseEstimate estimate = scene.estimated();
  EXPECT_TRUE(estimate.is_trusted);
  EXPECT_LT(error_m(estimate, move), 1e-3);
}

TEST(MotionPose, IsThatOfACameraThatMoves) {
  RelativePose move;
  move.translation = {0.012, 0.002, -0.004};
  Thing still_cart = cart;
  still_cart.motion_m = {};
  WallScene scene(move, {still_cart, standing_person});
  const RelativePoseEstimate estimate = scene.estimated();
  EXPECT_TRUE(estimate.is_trusted);
  EXPECT_LT(error_m(estimate, move), 1e-3);
}

/// A corner's own pixel often has no depth; the surface around it has.
TEST(MotionPose, TakesTheDepthAroundAFeature) {
  RelativePose move;
  move.translation = {0.012, 0.002, 0};
  WallScene scene(move, {{{200, 150, 240, 300}, 2.0, {}, Suspicion::none, 8}});
  const std::size_t before = scene.estimated().observations;
  for (int y = 0; y < wall_image_size.height; ++y) {
    for (int x = 1; x < wall_image_size.width; x += 2) scene.depth().at<float>(y, x) = 0;
  }
  EXPECT_EQ(scene.estimated().observations, before);
  EXPECT_LT(error_m(scene.estimated(), move), 1e-3);
  MotionJudgeOptions own_pixel_only;
  own_pixel_only.max_pose_depth_range_m = 0;
  EXPECT_LT(scene.estimated(true, own_pixel_only).observations, before);
}

}  // namespace
}  // namespace dynfilter::detail
