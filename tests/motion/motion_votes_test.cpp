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

FrameFeatures features_at(const std::vector<cv::Point2f>& points) {
  FrameFeatures features;
  features.read(points);
  return features;
}

bool may_be_one_thing(const FeatureMotion& a, const FeatureMotion& b) {
  return !(a.depth_m > 0 && b.depth_m > 0) || std::abs(a.depth_m - b.depth_m) <= 0.3;
}

bool is_seed(const FeatureMotion& motion) { return motion.evidence >= MotionEvidence::seed; }

/// Oracle: sorts all that may vote by distance, and hears the nearest corners.
template <class MayVote>
std::vector<std::size_t> naive_voices(const std::vector<cv::Point2f>& points, std::size_t seed,
                                      double radius_px, std::size_t most, const MayVote& may_vote) {
  const cv::Point own = nearest_pixel(points[seed]);
  std::vector<std::tuple<double, int, int, std::size_t>> others;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point pixel = nearest_pixel(points[i]);
    const double distance = cv::norm(pixel - own);
    if (i != seed && distance <= radius_px && may_vote(i))
      others.emplace_back(distance, pixel.y, pixel.x, i);
  }
  std::sort(others.begin(), others.end());
  others.resize(std::min(others.size(), 4 * std::max<std::size_t>(8, most)));
  std::vector<cv::Point> heard = {own};
  std::vector<std::size_t> voices;
  for (const auto& [distance, y, x, i] : others) {
    const cv::Point pixel(x, y);
    const bool is_new = std::none_of(heard.begin(), heard.end(),
                                     [&](cv::Point other) { return cv::norm(pixel - other) < 3; });
    if (!is_new || voices.size() == most) continue;
    heard.push_back(pixel);
    voices.push_back(i);
  }
  return voices;
}

bool naive_support(const std::vector<cv::Point2f>& points,
                   const std::vector<FeatureMotion>& motions, std::size_t seed) {
  const FeatureMotion& own = motions[seed];
  const auto voices = naive_voices(points, seed, 80, 8, [&](std::size_t i) {
    return motions[i].is_known() && may_be_one_thing(own, motions[i]);
  });
  const auto alike = std::count_if(voices.begin(), voices.end(), [&](std::size_t i) {
    return is_seed(motions[i]) && are_alike(own, motions[i]);
  });
  return own.is_known() && alike >= 4 &&
         5 * alike >= 3 * static_cast<std::ptrdiff_t>(voices.size());
}

bool naive_join(const std::vector<cv::Point2f>& points, const std::vector<FeatureMotion>& motions,
                const std::vector<bool>& has_support, std::size_t seed) {
  const FeatureMotion& own = motions[seed];
  const auto partners = naive_voices(points, seed, 50, 3, [&](std::size_t i) {
    return has_support[i] && may_be_one_thing(own, motions[i]) && are_alike(own, motions[i]);
  });
  return own.is_known() && own.depth_m > 0 && partners.size() == 3;
}

bool naive_crowd(const std::vector<cv::Point2f>& points, const std::vector<FeatureMotion>& motions,
                 std::size_t seed) {
  const FeatureMotion& own = motions[seed];
  const auto voices = naive_voices(points, seed, 50, 12, [&](std::size_t i) {
    return (motions[i].is_known() || is_seed(motions[i])) && may_be_one_thing(own, motions[i]);
  });
  const auto seeds = std::count_if(voices.begin(), voices.end(),
                                   [&](std::size_t i) { return is_seed(motions[i]); });
  return own.depth_m > 0 && voices.size() >= 6 &&
         5 * seeds >= 4 * static_cast<std::ptrdiff_t>(voices.size());
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
    FrameFeatures features = features_at(points);
    support_seeds(features, {}, motions);
    EXPECT_EQ(motions[0].evidence, MotionEvidence::supported);
    EXPECT_EQ(motions[12].evidence,
              middle_m > 0 ? MotionEvidence::supported : MotionEvidence::seed);
  }
}

TEST(MotionVotes, AreThoseOfTheNearest) {
  cv::RNG random(6);
  std::size_t supported = 0, joined = 0, crowded = 0, seeds = 0;
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
      if (moves && !is_lost && random.uniform(0, 4) == 0) motions.back().shift_px[0][0] *= -1;
      if (is_lost && random.uniform(0, 2) == 0) motions.back().evidence = MotionEvidence::seed;
      if (moves && !is_lost && random.uniform(0, 3) == 0) {
        motions.back().approach_m = static_cast<float>(random.uniform(0, 4) - 1) / 100;
      }
      const bool is_before = moves || random.uniform(0, 4) == 0;
      const bool has_depth = random.uniform(0, 3) > 0;
      motions.back().depth_m =
          has_depth ? (is_before ? 2.0F : 2.4F) + static_cast<float>(random.gaussian(0.05)) : 0;
    }
    FrameFeatures features = features_at(points);
    std::vector<FeatureMotion> voted = motions;
    support_seeds(features, {}, voted);
    std::vector<bool> has_support;
    for (std::size_t i = 0; i < points.size(); ++i) {
      has_support.push_back(is_seed(motions[i]) && naive_support(points, motions, i));
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
      const bool is_crowded_in = naive_crowd(points, motions, i);
      joined += joins ? 1 : 0;
      crowded += is_crowded_in && !joins && !has_support[i] ? 1 : 0;
      EXPECT_EQ(is_supported, has_support[i] || joins || is_crowded_in) << round << ' ' << i;
    }
  }
  EXPECT_GT(supported - joined - crowded, seeds / 10);  // all answers occur
  EXPECT_GT(std::min(joined, crowded), seeds / 20);
  EXPECT_LT(supported, seeds * 9 / 10);
}

TEST(MotionVotes, HearOneCornerOnce) {
  // Five seeds of one corner, whose track failed, among still features.
  std::vector<cv::Point2f> points = {{100, 100}, {100, 100}, {101, 100}, {100, 101}, {101, 101}};
  std::vector<FeatureMotion> motions(5, motion_of(MotionEvidence::seed, {4, 0}));
  FrameFeatures features = features_at(points);
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
  FrameFeatures features = features_at(points);
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
    FrameFeatures features = features_at(points);
    MotionVotesOptions options;
    options.crowd_radius_px = 1;  // there is none among seeds
    support_seeds(features, options, motions);
    EXPECT_FALSE(motions[0].has_support);
    for (std::size_t i = 1; i <= partners.size(); ++i) EXPECT_TRUE(motions[i].has_support) << i;
    return motions[0].evidence == MotionEvidence::supported;
  };
  EXPECT_TRUE(is_joined({{206, 200}, {206, 204}, {206, 196}}));
  EXPECT_FALSE(is_joined({{206, 200}, {206, 201}, {207, 200}}));  // one corner
  EXPECT_FALSE(is_joined({{202, 200}, {206, 204}, {206, 196}}));  // one is of the seed's own
}

/// Persons who cross each other, and their limbs, move in many ways.
TEST(MotionVotes, AreNotNeededAmongSeeds) {
  const auto evidence = [](std::size_t others, std::size_t quiet, float depth_m) {
    std::vector<cv::Point2f> points = {{100, 100}};
    std::vector<FeatureMotion> motions = {motion_of(MotionEvidence::seed, {4, 0})};
    for (std::size_t i = 0; i < others; ++i) {
      const auto angle = static_cast<float>(i);
      points.emplace_back(100 + 30 * std::cos(angle), 100 + 30 * std::sin(angle));
      motions.push_back(i < quiet ? motion_of(MotionEvidence::quiet)
                                  : motion_of(MotionEvidence::seed, {0, 3 + 5 * angle}));
      motions.back().depth_m = 2;
    }
    motions[0].depth_m = depth_m;
    motions.back().is_tracked[0] = false;
    FrameFeatures features = features_at(points);
    support_seeds(features, {}, motions);
    EXPECT_FALSE(motions[0].has_support);
    return motions[0].evidence;
  };
  EXPECT_EQ(evidence(12, 2, 2), MotionEvidence::supported);
  EXPECT_EQ(evidence(12, 3, 2), MotionEvidence::seed);
  EXPECT_EQ(evidence(6, 0, 2), MotionEvidence::supported);
  EXPECT_EQ(evidence(5, 0, 2), MotionEvidence::seed);
  EXPECT_EQ(evidence(12, 0, 0), MotionEvidence::seed);
  EXPECT_EQ(evidence(12, 0, 3), MotionEvidence::seed);
}

/// How a feature moves that was not tracked is not known: nobody moves as it does.
TEST(MotionVotes, SupportNobodyWithoutATrack) {
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
  FrameFeatures features = features_at(points);
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
  FrameFeatures features = features_at(std::vector<cv::Point2f>(6, {nowhere, nowhere}));
  std::vector<FeatureMotion> motions(6, motion_of(MotionEvidence::seed, {4, 0}));
  for (FeatureMotion& motion : motions) motion.depth_m = 2;
  support_seeds(features, {}, motions);
  for (const FeatureMotion& motion : motions) EXPECT_EQ(motion.evidence, MotionEvidence::seed);
}

/// What the last call wrote is no evidence for this one.
TEST(MotionVotes, DoNotKeepSupport) {
  FrameFeatures features =
      features_at(std::vector<cv::Point2f>{{100, 100}, {120, 100}, {110, 110}, {110, 120}});
  std::vector<FeatureMotion> motions(4, motion_of(MotionEvidence::seed, {4, 0}));
  for (FeatureMotion& motion : motions) {
    motion.depth_m = 2;
    motion.has_support = true;
  }
  support_seeds(features, {}, motions);
  for (const FeatureMotion& motion : motions) EXPECT_EQ(motion.evidence, MotionEvidence::seed);
}

TEST(MotionVotes, RefuseNonsense) {
  FrameFeatures features = features_at(std::vector<cv::Point2f>(2));
  std::vector<FeatureMotion> motions(1);
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, {}, motions); },
                                               "1 motions and 2 features");
  motions.resize(2);
  const auto refuses = [&](auto member, auto value, const std::string& message) {
    MotionVotesOptions options;
    options.*member = value;
    testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                                 message);
  };
  using Options = MotionVotesOptions;
  refuses(&Options::neighbours, 31U, "neighbours = 31");
  refuses(&Options::max_depth_difference_m, -1, "max_depth_difference_m = -1");
  refuses(&Options::min_crowd_share, 1.1, "min_crowd_share = 1.1");
  for (const int radius_px : {0, 1001}) {
    refuses(&Options::join_radius_px, radius_px, "join_radius_px = " + std::to_string(radius_px));
    refuses(&Options::crowd_radius_px, radius_px, "crowd_radius_px = " + std::to_string(radius_px));
  }
  for (const std::size_t count : {0U, 31U}) {
    refuses(&Options::min_joined, count, "min_joined = " + std::to_string(count));
    refuses(&Options::crowd_neighbours, count, "crowd_neighbours = " + std::to_string(count));
  }
}

}  // namespace
}  // namespace dynfilter
