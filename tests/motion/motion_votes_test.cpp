// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_votes.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

FeatureMotion motion_of(MotionEvidence evidence, cv::Vec2f shift_px = {}) {
  FeatureMotion motion;
  motion.evidence = evidence;
  motion.shift_px[0] = shift_px;
  motion.is_tracked[0] = evidence != MotionEvidence::unknown;
  return motion;
}

bool are_alike(const FeatureMotion& a, const FeatureMotion& b) {
  const bool both_go = a.approach_m != 0 && b.approach_m != 0;
  if (both_go) return (a.approach_m > 0) == (b.approach_m > 0);
  const double limit = 0.3 * cv::norm(a.shift_px[0]) + 0.5;
  return cv::norm(a.shift_px[0] - b.shift_px[0]) <= limit;
}

/// Oracle: sorts all features by distance and asks the nearest, as the documentation says.
bool naive_support(const std::vector<cv::Point2f>& points,
                   const std::vector<FeatureMotion>& motions, std::size_t seed,
                   const MotionVotesOptions& options) {
  std::vector<std::tuple<double, int, int, std::size_t>> others;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point pixel(nearest_pixel(points[i])), away = pixel - nearest_pixel(points[seed]);
    const float depth_m = motions[i].depth_m, own_m = motions[seed].depth_m;
    const bool is_apart = depth_m > 0 && own_m > 0 && std::abs(depth_m - own_m) > 0.3;
    const bool votes = i != seed && motions[i].is_known() && !is_apart;
    if (votes && cv::norm(away) <= options.radius_px)
      others.emplace_back(cv::norm(away), pixel.y, pixel.x, i);
  }
  std::sort(others.begin(), others.end());
  others.resize(std::min<std::size_t>(others.size(), 32));
  std::vector<cv::Point> heard = {nearest_pixel(points[seed])};
  std::size_t alike = 0;
  for (const auto& [distance, y, x, i] : others) {
    const cv::Point pixel(x, y);
    if (heard.size() > options.neighbours) break;
    if (std::any_of(heard.begin(), heard.end(), [&](cv::Point other) {
          return cv::norm(pixel - other) < options.min_spacing_px;
        }))
      continue;
    heard.push_back(pixel);
    const bool is_seed = motions[i].evidence >= MotionEvidence::seed;
    alike += is_seed && are_alike(motions[seed], motions[i]);
  }
  return alike >= 4 && static_cast<double>(alike) >= 0.6 * static_cast<double>(heard.size() - 1);
}

/// Oracle: sorts by distance the features with support that a seed may join, and counts corners.
bool naive_join(const std::vector<cv::Point2f>& points, const std::vector<FeatureMotion>& motions,
                const std::vector<bool>& has_support, std::size_t seed) {
  const cv::Point own = nearest_pixel(points[seed]);
  std::vector<std::tuple<double, int, int>> partners;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point pixel = nearest_pixel(points[i]);
    const float depth_m = motions[i].depth_m, own_m = motions[seed].depth_m;
    const bool may_be_one = own_m > 0 && (depth_m == 0 || std::abs(depth_m - own_m) <= 0.3);
    const bool may_join = i != seed && has_support[i] && cv::norm(pixel - own) <= 50;
    if (may_join && may_be_one && are_alike(motions[seed], motions[i]))
      partners.emplace_back(cv::norm(pixel - own), pixel.y, pixel.x);
  }
  std::sort(partners.begin(), partners.end());
  partners.resize(std::min<std::size_t>(partners.size(), 32));
  std::vector<cv::Point> corners = {own};
  for (const auto& [distance, y, x] : partners) {
    const cv::Point pixel(x, y);
    const bool is_new = std::none_of(corners.begin(), corners.end(), [&](cv::Point corner) {
      return cv::norm(pixel - corner) < 3;
    });
    if (is_new) corners.push_back(pixel);
  }
  return corners.size() >= 4;
}

TEST(MotionVotes, TellNearerFromFarther) {
  for (const float middle_m : {0.02F, -0.02F}) {
    std::vector<cv::Point2f> points;
    std::vector<FeatureMotion> motions;
    for (int i = 0; i < 25; ++i) {
      points.emplace_back(cv::Point2f(cv::Point(100 + 10 * (i % 5), 100 + 10 * (i / 5))));
      motions.push_back(motion_of(MotionEvidence::seed));  // without a shift
      motions.back().approach_m = i == 12 ? middle_m : 0.02F;
    }
    FrameFeatures features;
    features.read(points);
    support_seeds(features, {}, motions);
    EXPECT_EQ(motions[0].evidence, MotionEvidence::supported);
    EXPECT_EQ(motions[12].evidence,
              middle_m > 0 ? MotionEvidence::supported : MotionEvidence::seed);
  }
}

TEST(MotionVotes, AreThoseOfTheNearest) {
  cv::RNG random(6);
  std::size_t supported = 0, joined = 0, seeds = 0;
  for (int round = 0; round < 40; ++round) {
    // In some rounds, corners have so many features that the nearest 32 are too few voices.
    const bool is_crowded = round >= 30;
    std::vector<cv::Point2f> points;
    std::vector<FeatureMotion> motions;
    for (int i = 0; i < (is_crowded ? 900 : 250); ++i) {
      points.emplace_back(random.uniform(0.0F, 200.0F), random.uniform(0.0F, 200.0F));
      if (is_crowded) points.back() = 15 * cv::Point2f(cv::Point(points.back() / 15));
      const bool moves = points.back().x < 90 && random.uniform(0, 10) < 8;
      const cv::Vec2f shift(3 + static_cast<float>(random.gaussian(0.7)), 0);
      const bool is_lost = random.uniform(0, 10) == 0;
      motions.push_back(is_lost ? motion_of(MotionEvidence::unknown)
                        : moves ? motion_of(MotionEvidence::seed, shift)
                                : motion_of(MotionEvidence::quiet));
      if (moves && random.uniform(0, 3) == 0) {
        motions.back().approach_m = static_cast<float>(random.uniform(0, 4) - 1) / 100;
      }
      const bool is_before = moves || random.uniform(0, 4) == 0;
      const bool has_depth = random.uniform(0, 3) > 0;
      motions.back().depth_m =
          has_depth ? (is_before ? 2.0F : 2.4F) + static_cast<float>(random.gaussian(0.05)) : 0;
    }
    FrameFeatures features;
    features.read(points);
    std::vector<FeatureMotion> voted = motions;
    support_seeds(features, {}, voted);
    std::vector<bool> has_support;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool is_seed = motions[i].evidence == MotionEvidence::seed;
      has_support.push_back(is_seed && naive_support(points, motions, i, {}));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (motions[i].evidence != MotionEvidence::seed) {
        EXPECT_EQ(voted[i].evidence, motions[i].evidence);
        continue;
      }
      ++seeds;
      const bool is_supported = voted[i].evidence == MotionEvidence::supported;
      supported += is_supported ? 1 : 0;
      const bool joins = !has_support[i] && naive_join(points, motions, has_support, i);
      joined += joins ? 1 : 0;
      EXPECT_EQ(is_supported, has_support[i] || joins) << round << ' ' << i;
    }
  }
  EXPECT_GT(supported - joined, seeds / 10);  // all answers occur
  EXPECT_GT(joined, seeds / 20);
  EXPECT_LT(supported, seeds * 9 / 10);
}

TEST(MotionVotes, HearOneCornerOnce) {
  // Five seeds of one corner, whose track failed, among still features.
  std::vector<cv::Point2f> points = {{100, 100}, {100, 100}, {101, 100}, {100, 101}, {101, 101}};
  std::vector<FeatureMotion> motions(5, motion_of(MotionEvidence::seed, {4, 0}));
  FrameFeatures features;
  features.read(points);
  support_seeds(features, {}, motions);
  for (const FeatureMotion& motion : motions) EXPECT_EQ(motion.evidence, MotionEvidence::seed);
}

TEST(MotionVotes, AreNotThoseOfTheWallBehind) {
  // Six features of a thing that moves, at the edge of a wall with many more.
  std::vector<cv::Point2f> points;
  std::vector<FeatureMotion> motions;
  for (int i = 0; i < 18; ++i) {
    const bool moves = i < 6;
    points.emplace_back(100.0F + 4.0F * static_cast<float>(i / 6),
                        100.0F + 4.0F * static_cast<float>(i % 6));
    motions.push_back(moves ? motion_of(MotionEvidence::seed, {4, 0})
                            : motion_of(MotionEvidence::quiet));
    motions.back().depth_m = moves ? 2.0F : 3.0F;
  }
  FrameFeatures features;
  features.read(points);
  std::vector<FeatureMotion> without = motions;
  for (FeatureMotion& motion : without) motion.depth_m = 0;
  support_seeds(features, {}, motions);
  support_seeds(features, {}, without);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(motions[i].evidence, MotionEvidence::supported);
    EXPECT_EQ(without[i].evidence, MotionEvidence::seed);
  }
}

/// At the edge of a thing, most neighbours may be static and at its depth, such as the floor.
TEST(MotionVotes, AreJoinedAtTheEdgeOfAThing) {
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
  FrameFeatures features;
  features.read(points);
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
  const FeatureMotion seed = motions[edge];
  EXPECT_EQ(evidence_at_edge(seed, {}), MotionEvidence::supported);
  MotionVotesOptions options;
  options.min_joined = 30;
  options.join_radius_px = 25;  // there are fewer features within it
  EXPECT_EQ(evidence_at_edge(seed, options), MotionEvidence::seed);
  options = {};
  options.join_radius_px = 7;
  EXPECT_EQ(evidence_at_edge(seed, options), MotionEvidence::seed);
  FeatureMotion other = seed;
  other.depth_m = 0;
  EXPECT_EQ(evidence_at_edge(other, {}), MotionEvidence::seed);
  other.depth_m = 3;
  EXPECT_EQ(evidence_at_edge(other, {}), MotionEvidence::seed);
  other = seed;
  other.shift_px[0] = {-4, 0};
  EXPECT_EQ(evidence_at_edge(other, {}), MotionEvidence::seed);
}

/// One corner may have features in several octaves. To join, a seed needs several corners.
TEST(MotionVotes, AreJoinedByCornersNotByTheirFeatures) {
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
    FrameFeatures features;
    features.read(points);
    support_seeds(features, {}, motions);
    EXPECT_FALSE(motions[0].has_support);
    for (std::size_t i = 1; i <= partners.size(); ++i) EXPECT_TRUE(motions[i].has_support) << i;
    return motions[0].evidence == MotionEvidence::supported;
  };
  EXPECT_TRUE(is_joined({{206, 200}, {206, 204}, {206, 196}}));
  EXPECT_FALSE(is_joined({{206, 200}, {206, 201}, {207, 200}}));  // one corner
  EXPECT_FALSE(is_joined({{202, 200}, {206, 204}, {206, 196}}));  // one is of the seed's own
}

/// However few neighbours vote, as many seeds may be joined as are asked for.
TEST(MotionVotes, JoinMoreSeedsThanNeighboursVote) {
  std::vector<cv::Point2f> points;
  for (int i = 0; i < 36; ++i) points.emplace_back(cv::Point(100 + 7 * (i % 6), 100 + 7 * (i / 6)));
  points.emplace_back(150.0F, 118.0F);  // at their edge: most beside it are quiet
  std::vector<FeatureMotion> motions(37, motion_of(MotionEvidence::seed, {4, 0}));
  for (int i = 0; i < 12; ++i) {
    points.emplace_back(cv::Point(154 + 4 * (i % 3), 112 + 4 * (i / 3)));
    motions.push_back(motion_of(MotionEvidence::quiet));
  }
  for (FeatureMotion& motion : motions) motion.depth_m = 2;
  FrameFeatures features;
  features.read(points);
  MotionVotesOptions options;
  options.neighbours = 4;
  options.min_joined = 20;
  support_seeds(features, options, motions);
  EXPECT_FALSE(motions[36].has_support);
  EXPECT_EQ(motions[36].evidence, MotionEvidence::supported);
}

/// Hosts may hand over features without a place.
TEST(MotionVotes, HearNothingOfFeaturesWithoutAPlace) {
  const float nowhere = std::nanf("");
  FrameFeatures features;
  features.read(std::vector<cv::Point2f>(6, {nowhere, nowhere}));
  std::vector<FeatureMotion> motions(6, motion_of(MotionEvidence::seed, {4, 0}));
  for (FeatureMotion& motion : motions) motion.depth_m = 2;
  support_seeds(features, {}, motions);
  for (const FeatureMotion& motion : motions) EXPECT_EQ(motion.evidence, MotionEvidence::seed);
}

/// What the last call wrote is no evidence for this one.
TEST(MotionVotes, DoNotKeepSupport) {
  FrameFeatures features;
  features.read(std::vector<cv::Point2f>{{100, 100}, {120, 100}, {110, 110}, {110, 120}});
  std::vector<FeatureMotion> motions(4, motion_of(MotionEvidence::seed, {4, 0}));
  for (FeatureMotion& motion : motions) {
    motion.depth_m = 2;
    motion.has_support = true;
  }
  support_seeds(features, {}, motions);
  for (const FeatureMotion& motion : motions) EXPECT_EQ(motion.evidence, MotionEvidence::seed);
}

TEST(MotionVotes, RefuseNonsense) {
  FrameFeatures features;
  features.read(std::vector<cv::Point2f>(2));
  std::vector<FeatureMotion> motions(1);
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, {}, motions); },
                                               "1 motions and 2 features");
  MotionVotesOptions options;
  options.neighbours = 31;
  motions.resize(2);
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                               "neighbours = 31");
  options = {};
  options.max_depth_difference_m = -1;
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                               "max_depth_difference_m = -1");
  options = {};
  options.join_radius_px = 0;
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                               "join_radius_px = 0");
  options = {};
  options.join_radius_px = 1001;
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                               "join_radius_px = 1001");
  for (const std::size_t count : {0U, 31U}) {
    options = {};
    options.min_joined = count;
    testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                                 "min_joined = " + std::to_string(count));
  }
}

}  // namespace
}  // namespace dynfilter
