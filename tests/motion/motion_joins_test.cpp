// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests of the seeds that join others, see support_seeds.

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_votes.hpp"
#include "motion/motion_votes_features.hpp"

namespace dynfilter {
namespace {

/// At the edge of a thing, most neighbours may be static and at its depth, such as the floor.
TEST(MotionJoins, AreMadeAtTheEdgeOfAThing) {
  std::vector<cv::Point2f> points;
  std::vector<FeatureMotion> motions;
  for (int i = 0; i < 100; ++i) {
    const int x = i % 10, y = i / 10;
    const bool moves = x < 5 || (x == 5 && y == 5);
    points.emplace_back(cv::Point2f(cv::Point(100 + 8 * x, 100 + 8 * y)));
    motions.push_back(moves ? motion_of(MotionEvidence::seed, {4, 0})
                            : motion_of(MotionEvidence::quiet));
    motions.back().depth_m = 2;
  }
  FrameFeatures features = features_at(points);
  const std::size_t edge = 55;
  const auto evidence_at_edge = [&](const FeatureMotion& motion,
                                    const MotionVotesOptions& options) {
    std::vector<FeatureMotion> voted = motions;
    voted[edge] = motion;
    support_seeds(features, options, voted);
    EXPECT_EQ(voted[52].evidence, MotionEvidence::supported);
    EXPECT_EQ(voted[57].evidence, MotionEvidence::quiet);
    return voted[edge].evidence;
  };
  MotionVotesOptions near;
  near.far_join_radius_px = 1;  // none joins from afar
  const FeatureMotion seed = motions[edge];
  EXPECT_EQ(evidence_at_edge(seed, near), MotionEvidence::supported);
  MotionVotesOptions options = near;
  options.min_joined = 30;
  options.join_radius_px = 25;  // there are fewer features within it
  EXPECT_EQ(evidence_at_edge(seed, options), MotionEvidence::seed);
  options = near;
  options.join_radius_px = 7;
  EXPECT_EQ(evidence_at_edge(seed, options), MotionEvidence::seed);
  FeatureMotion other = seed;
  other.depth_m = 0;
  EXPECT_EQ(evidence_at_edge(other, near), MotionEvidence::seed);
  other.depth_m = 3;
  EXPECT_EQ(evidence_at_edge(other, near), MotionEvidence::seed);
  other = seed;
  other.shift_px[0] = {-4, 0};
  EXPECT_EQ(evidence_at_edge(other, near), MotionEvidence::seed);
}

/// One corner may have features in several octaves. To join, a seed needs several corners.
TEST(MotionJoins, AreMadeByCornersNotByTheirFeatures) {
  const auto is_joined = [](const std::vector<cv::Point2f>& partners) {
    // The seed, then its partners, whose shift is between that of the seed and that of a thing.
    std::vector<cv::Point2f> points = {{200, 200}};
    std::vector<FeatureMotion> motions = {motion_of(MotionEvidence::seed, {4, 0})};
    for (const cv::Point2f& partner : partners) {
      points.push_back(partner);
      motions.push_back(motion_of(MotionEvidence::seed, {5.5F, 0}));
    }
    for (int i = 0; i < 36; ++i) {
      points.emplace_back(cv::Point2f(cv::Point(160 + 7 * (i % 6), 184 + 7 * (i / 6))));
      motions.push_back(motion_of(MotionEvidence::seed, {7, 0}));
    }
    for (FeatureMotion& motion : motions) motion.depth_m = 2;
    FrameFeatures features = features_at(points);
    MotionVotesOptions options;
    options.crowd_radius_px = 1;  // there is none among seeds
    support_seeds(features, options, motions);
    EXPECT_FALSE(motions[0].neighbours_agree);
    for (std::size_t i = 1; i <= partners.size(); ++i)
      EXPECT_TRUE(motions[i].neighbours_agree) << i;
    return motions[0].evidence == MotionEvidence::supported;
  };
  EXPECT_TRUE(is_joined({{206, 200}, {206, 204}, {206, 196}}));
  EXPECT_FALSE(is_joined({{206, 200}, {206, 201}, {207, 200}}));  // one corner
  EXPECT_FALSE(is_joined({{202, 200}, {206, 204}, {206, 196}}));  // one is of the seed's own
}

/// How a feature moves that was not tracked is not known: nobody moves as it does.
TEST(MotionJoins, AreNotMadeWithoutATrack) {
  std::vector<cv::Point2f> points = {{100, 100}};
  std::vector<FeatureMotion> motions = {motion_of(MotionEvidence::seed)};
  for (int i = 0; i < 24; ++i) {
    points.emplace_back(cv::Point(80 + 8 * (i % 6), 110 + 8 * (i / 6)));
    motions.push_back(motion_of(MotionEvidence::seed));
    motions.back().approach_m = 0.1F;  // along the view, without a shift
  }
  for (FeatureMotion& motion : motions) motion.depth_m = 2;
  FrameFeatures features = features_at(points);
  MotionVotesOptions options;
  options.crowd_radius_px = 1;  // there is none among seeds
  for (const bool is_tracked : {true, false}) {
    std::vector<FeatureMotion> voted = motions;
    voted[0].is_tracked[0] = is_tracked;
    support_seeds(features, options, voted);
    EXPECT_EQ(voted[0].evidence == MotionEvidence::supported, is_tracked);
  }
}

/// However few neighbours vote, as many seeds may be joined as are asked for.
TEST(MotionJoins, MayNeedMoreSeedsThanNeighboursVote) {
  std::vector<cv::Point2f> points;
  for (int i = 0; i < 36; ++i) points.emplace_back(cv::Point(100 + 7 * (i % 6), 100 + 7 * (i / 6)));
  points.emplace_back(150.0F, 118.0F);  // at their edge: most beside it are quiet
  std::vector<FeatureMotion> motions(37, motion_of(MotionEvidence::seed, {4, 0}));
  for (int i = 0; i < 12; ++i) {
    points.emplace_back(cv::Point(154 + 4 * (i % 3), 112 + 4 * (i / 3)));
    motions.push_back(motion_of(MotionEvidence::quiet));
  }
  for (FeatureMotion& motion : motions) motion.depth_m = 2;
  FrameFeatures features = features_at(points);
  MotionVotesOptions options;
  options.neighbours = 4;
  options.min_joined = 20;
  support_seeds(features, options, motions);
  EXPECT_FALSE(motions[36].neighbours_agree);
  EXPECT_EQ(motions[36].evidence, MotionEvidence::supported);
}

/// A thing with little texture has features far apart. They must move still more alike.
TEST(MotionJoins, ReachFarWhereMoreMoveStillMoreAlike) {
  const auto is_joined = [](std::size_t partners, float distance_px, cv::Vec2f shift_px,
                            bool is_beside_object) {
    std::vector<cv::Point2f> points = {{100, 100}};
    std::vector<FeatureMotion> motions = {motion_of(MotionEvidence::seed, shift_px)};
    motions[0].is_beside_object = is_beside_object;
    for (std::size_t i = 0; i < partners; ++i) {
      points.emplace_back(100 + distance_px, 90 + 4 * static_cast<float>(i));
      motions.push_back(motion_of(MotionEvidence::seed, {10, 0}));
    }
    for (int i = 0; i < 20; ++i) {  // more of the same thing, out of reach
      points.emplace_back(cv::Point(125 + cvCeil(distance_px) + 4 * (i / 5), 90 + 4 * (i % 5)));
      motions.push_back(motion_of(MotionEvidence::seed, {-10, 0}));
      if (i < 10) motions.back().shift_px[0] = {10, 0};
    }
    for (int i = 0; i < 12; ++i) {  // static ones beside the seed
      points.emplace_back(cv::Point(80 + 4 * (i % 4), 90 + 4 * (i / 4)));
      motions.push_back(motion_of(MotionEvidence::quiet));
    }
    for (FeatureMotion& motion : motions) motion.depth_m = 2;
    FrameFeatures features = features_at(points);
    support_seeds(features, {}, motions);
    for (std::size_t i = 1; i <= partners; ++i) EXPECT_TRUE(motions[i].neighbours_agree) << i;
    EXPECT_FALSE(motions[0].neighbours_agree);
    return motions[0].evidence == MotionEvidence::supported;
  };
  EXPECT_TRUE(is_joined(6, 110, {11.5F, 0}, false));
  EXPECT_FALSE(is_joined(4, 110, {11.5F, 0}, false)) << "too few";
  EXPECT_FALSE(is_joined(6, 125, {11.5F, 0}, false)) << "too far";
  EXPECT_FALSE(is_joined(6, 110, {12.5F, 0}, false)) << "near ones may differ as much";
  EXPECT_TRUE(is_joined(6, 30, {12.5F, 0}, false));
  EXPECT_FALSE(is_joined(6, 110, {11.5F, 0}, true)) << "a mask beside it holds what moves";
  EXPECT_TRUE(is_joined(6, 30, {11.5F, 0}, true));
}

}  // namespace
}  // namespace dynfilter
