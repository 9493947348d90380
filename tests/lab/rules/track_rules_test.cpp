// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/lab/rules that judge tracks, on frames made by hand; one of them beside a naive
// reading of its description on random frames.

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "lab/rules/person_rules.hpp"
#include "lab/rules/point_rules.hpp"
#include "support/pair_scene.hpp"

namespace dynfilter::testing {
namespace {

// --- FlowChiSquare -------------------------------------------------------------------------------

TEST(FlowChiSquare, RemovesWhatMovesAndKeepsWhatTheCameraExplains) {
  const PairScene moving = room_with_person({0.05, 0, 0});
  EXPECT_EQ(moving.verdicts(peers::FlowChiSquare()), room_kept(moving, 'x'));
  const PairScene still = room_with_person({0, 0, 0});
  EXPECT_EQ(still.verdicts(peers::FlowChiSquare()), room_kept(still, 'o'));
}

TEST(FlowChiSquare, AbstainsWithoutPoseTrackOrDepth) {
  PairScene scene = room_with_person({0.1, 0, 0});
  const std::size_t last = scene.features.size() - 1;
  scene.tracks[last].is_found = false;
  PairScene::set_depth(scene.frame.depth, scene.features[last - 1], 0);
  const FeatureLabels labels = scene.labels(peers::FlowChiSquare());
  EXPECT_EQ(labels.statistics().removed(), 14U);
  scene.pose.reset();
  EXPECT_EQ(scene.labels(peers::FlowChiSquare()).statistics().removed(), 0U);
  scene.has_earlier = false;
  EXPECT_EQ(scene.labels(peers::FlowChiSquare()).statistics().removed(), 0U);
}

/// Chi-square with derivatives by differences. Parameters: depth, motion along and about each axis.
double chi_square_reading(const PairScene& scene, std::size_t i, double depth_m) {
  const auto predicted = [&](const std::array<double, 7>& p) {
    const cv::Point2f at = scene.features[i];
    const double z = depth_m + p[0];
    const cv::Vec3d point((at.x - 80) / 120 * z, (at.y - 60) / 120 * z, z);
    const cv::Vec3d turned = scene.pose->rotation * point;
    const cv::Vec3d turn(p[4], p[5], p[6]);
    const cv::Vec3d then =
        turned + turn.cross(turned) + scene.pose->translation + cv::Vec3d(p[1], p[2], p[3]);
    return cv::Vec2d(120 * then[0] / then[2] + 80, 120 * then[1] / then[2] + 60);
  };
  const double z_noise = 0.0025 * depth_m * depth_m;
  const double t = 0.002, w = 0.0005;
  const std::array<double, 7> deviations = {z_noise, t, t, t, w, w, w};
  cv::Matx22d covariance = cv::Matx22d::eye() * 0.3 * 0.3;
  for (std::size_t k = 0; k < 7; ++k) {
    std::array<double, 7> more{}, less{};
    more[k] = 1e-5;
    less[k] = -1e-5;
    const cv::Vec2d slope = (predicted(more) - predicted(less)) * (deviations[k] / 2e-5);
    covariance += slope * slope.t();
  }
  const cv::Point2f tracked = scene.tracks[i].position;
  const cv::Vec2d residual = cv::Vec2d(tracked.x, tracked.y) - predicted({});
  cv::Vec2d solved;
  cv::solve(covariance, residual, solved, cv::DECOMP_CHOLESKY);
  return residual.dot(solved);
}

TEST(FlowChiSquare, EqualsTheReadingOnRandomFrames) {
  std::size_t removals = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const PairScene scene = arbitrary_pair(seed);
    const std::vector<bool> removed = removed_by(peers::FlowChiSquare(), scene);
    for (std::size_t i = 0; i < removed.size(); ++i) {
      const cv::Point pixel = nearest_pixel(scene.features[i]);
      const auto depth_m = scene.frame.depth_m(pixel);
      if (!scene.tracks[i].is_found || !depth_m) {
        ASSERT_FALSE(removed[i]);
        continue;
      }
      const double value = chi_square_reading(scene, i, *depth_m);
      if (std::abs(value - 9.21) < 1e-4) continue;  // the differences' error
      ASSERT_EQ(removed[i], value > 9.21) << "seed " << seed << ", feature " << i;
      ++(removed[i] ? removals : kept);
    }
  }
  EXPECT_GT(removals, 500U);
  EXPECT_GT(kept, 500U);
}

// --- FlowRefinedMask -----------------------------------------------------------------------------

TEST(FlowRefinedMask, RemovesAMovingPersonAndWhatMovesAround) {
  PairScene scene = room_with_person({0.05, 0, 0});
  scene.add({110, 60}, 1.2, {0.05, 0, 0});  // the mask missed it
  scene.add({124, 60}, 1.2, {0.05, 0, 0});  // too far from it
  const peers::FlowRefinedMask rule;
  EXPECT_EQ(scene.verdicts(rule),
            std::string(scene.features.size() - 18, 'o') + std::string(16, 'x') + "xo");
  const PairScene still = room_with_person({0, 0, 0});
  EXPECT_EQ(still.verdicts(rule), room_kept(still, 'o'));
}

TEST(FlowRefinedMask, TrustsTheMaskWithoutFlow) {
  PairScene scene = room_with_person({0, 0, 0});
  scene.pose.reset();
  EXPECT_EQ(scene.verdicts(peers::FlowRefinedMask()), room_kept(scene, 'x'));
  scene.has_earlier = false;
  EXPECT_EQ(scene.verdicts(peers::FlowRefinedMask()), room_kept(scene, 'x'));
}

// --- PointCorrelations ---------------------------------------------------------------------------

TEST(PointCorrelations, RemovesAPersonWhoComesNearerAndNeedsNoPose) {
  PairScene moving = room_with_person({0, 0, 0.3});
  moving.pose.reset();
  EXPECT_EQ(moving.verdicts(peers::PointCorrelations()), room_kept(moving, 'x'));
  const PairScene still = room_with_person({0, 0, 0});
  EXPECT_EQ(still.verdicts(peers::PointCorrelations()), room_kept(still, 'o'));
}

/// An edge across the motion keeps its length, and one is enough to hold the parts together.
TEST(PointCorrelations, MissesAPersonWhoCrossesTheView) {
  const PairScene moving = room_with_person({0.15, 0, 0});
  EXPECT_EQ(moving.verdicts(peers::PointCorrelations()), room_kept(moving, 'o'));
}

TEST(PointCorrelations, KeepsWhatCannotBeCompared) {
  PairScene scene = room_with_person({0, 0, 0.3});
  scene.tracks.back().is_found = false;
  EXPECT_FALSE(scene.labels(peers::PointCorrelations()).is_removed(scene.features.size() - 1));
  scene.has_earlier = false;
  EXPECT_EQ(scene.labels(peers::PointCorrelations()).statistics().removed(), 0U);
}

const cv::Rect image_area(0, 0, 160, 120);

// --- EpipolarVote --------------------------------------------------------------------------------

TEST(EpipolarVote, RemovesAPersonWhoLeavesTheEpipolarLines) {
  const PairScene scene = room_with_person({0.0, 0.06, 0});
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), room_kept(scene, 'x'));
}

TEST(EpipolarVote, KeepsAPersonWhoStandsStill) {
  const PairScene scene = room_with_person({0, 0, 0});
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), room_kept(scene, 'o'));
}

TEST(EpipolarVote, OneOutlierBesideOnePersonRemovesAll) {
  const auto removed_with = [](float x) {
    PairScene scene = room_with_person({0, 0, 0});
    scene.add({x, 60}, 1.3, {0, 0.08, 0});  // on no mask
    scene.add_masked({5, 5, 20, 20});       // with four features
    return scene.labels(peers::EpipolarVote()).statistics().removed();
  };
  EXPECT_EQ(removed_with(112), 20U) << "13 px beside the mask";
  EXPECT_EQ(removed_with(116), 0U);
}

TEST(EpipolarVote, NeedsEightTracks) {
  PairScene scene;
  scene.move_camera({0.04, 0.01, -0.02}, {0.004, -0.006, 0.003});
  const cv::Point2f pixels[] = {{20, 20},  {70, 25}, {130, 30}, {40, 60},
                                {110, 65}, {25, 95}, {80, 100}};
  for (std::size_t i = 0; i < 7; ++i) {
    scene.add(pixels[i], 1.2 + 0.4 * static_cast<double>(i * 3 % 5));
  }
  scene.add_masked(image_area);
  scene.add({135, 95}, 1.5, {0.1, -0.3, 0});  // no geometry holds for this one and all others
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), "xxxxxxxx");
  scene.tracks[0].is_found = false;
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), "oooooooo");
}

// --- ClusterVotes --------------------------------------------------------------------------------

TEST(ClusterVotes, RemovesAClusterThatIsFastEnough) {
  const peers::ClusterVotes rule;  // 0.1 s between the frames: 0.45 m/s are 0.045 m
  const PairScene fast = room_with_person({0.05, 0, 0});
  EXPECT_EQ(fast.verdicts(rule), room_kept(fast, 'x'));
  const PairScene slow = room_with_person({0.04, 0, 0});
  EXPECT_EQ(slow.verdicts(rule), room_kept(slow, 'o'));
}

TEST(ClusterVotes, NeedsFourFifthsOrAHundredVotes) {
  const auto removed_with = [](std::size_t still, std::size_t moving) {
    PairScene scene = room_with_person({0.1, 0, 0});
    for (std::size_t k = 0; k < still + moving; ++k) {
      const cv::Vec3d shift_m(k < still ? 0 : 0.1, 0, 0);
      scene.add({70 + 2 * static_cast<float>(k / 5), 46 + 8 * static_cast<float>(k % 5)}, 1.2,
                shift_m);
    }
    return scene.labels(peers::ClusterVotes()).statistics().removed();
  };
  EXPECT_EQ(removed_with(4, 0), 20U) << "16 of 20";
  EXPECT_EQ(removed_with(5, 0), 0U) << "16 of 21";
}

}  // namespace
}  // namespace dynfilter::testing
