// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_votes.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>
#include <vector>

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

FrameFeatures features_at(const std::vector<cv::Point2f>& points) {
  FrameFeatures features;
  features.read(points);
  return features;
}

bool are_alike(const FeatureMotion& a, const FeatureMotion& b, double share = 0.3) {
  const bool both_go = a.approach_m != 0 && b.approach_m != 0;
  if (both_go) return (a.approach_m > 0) == (b.approach_m > 0);
  const double limit = share * cv::norm(a.shift_px[0]) + 0.5;
  return cv::norm(a.shift_px[0] - b.shift_px[0]) <= limit;
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
    return motions[i].was_tracked() && may_be_one_thing(own, motions[i]);
  });
  const auto alike = std::count_if(voices.begin(), voices.end(), [&](std::size_t i) {
    return is_seed(motions[i]) && are_alike(own, motions[i]);
  });
  return own.was_tracked() && alike >= 4 &&
         5 * alike >= 3 * static_cast<std::ptrdiff_t>(voices.size());
}

bool naive_join(const std::vector<cv::Point2f>& points, const std::vector<FeatureMotion>& motions,
                const std::vector<bool>& neighbours_agree, std::size_t seed) {
  const FeatureMotion& own = motions[seed];
  const auto joins = [&](double radius_px, std::size_t count, double share) {
    const auto partners = naive_voices(points, seed, radius_px, count, [&](std::size_t i) {
      return neighbours_agree[i] && may_be_one_thing(own, motions[i]) &&
             are_alike(own, motions[i], share);
    });
    return partners.size() == count;
  };
  const bool may_join = own.was_tracked() && own.depth_m > 0;
  return may_join && (joins(50, 3, 0.3) || (!own.is_beside_object && joins(120, 5, 0.15)));
}

bool naive_crowd(const std::vector<cv::Point2f>& points, const std::vector<FeatureMotion>& motions,
                 std::size_t seed) {
  const FeatureMotion& own = motions[seed];
  const auto voices = naive_voices(points, seed, 50, 12, [&](std::size_t i) {
    return (motions[i].was_tracked() || is_seed(motions[i])) && may_be_one_thing(own, motions[i]);
  });
  const auto seeds = std::count_if(voices.begin(), voices.end(),
                                   [&](std::size_t i) { return is_seed(motions[i]); });
  return own.depth_m > 0 && voices.size() >= 6 &&
         5 * seeds >= 4 * static_cast<std::ptrdiff_t>(voices.size());
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
      motions.back().is_beside_object = random.uniform(0, 4) == 0;
      motions.back().depth_m =
          has_depth ? (is_before ? 2.0F : 2.4F) + static_cast<float>(random.gaussian(0.05)) : 0;
    }
    FrameFeatures features = features_at(points);
    std::vector<FeatureMotion> voted = motions;
    support_seeds(features, {}, voted);
    std::vector<bool> neighbours_agree;
    for (std::size_t i = 0; i < points.size(); ++i) {
      neighbours_agree.push_back(is_seed(motions[i]) && naive_support(points, motions, i));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (motions[i].evidence != MotionEvidence::seed) {
        EXPECT_EQ(voted[i].evidence, motions[i].evidence);
        continue;
      }
      ++seeds;
      const bool is_supported = voted[i].evidence == MotionEvidence::supported;
      supported += is_supported ? 1 : 0;
      const bool joins = !neighbours_agree[i] && naive_join(points, motions, neighbours_agree, i);
      const bool is_crowded_in = naive_crowd(points, motions, i);
      joined += joins ? 1 : 0;
      crowded += is_crowded_in && !joins && !neighbours_agree[i] ? 1 : 0;
      EXPECT_EQ(is_supported, neighbours_agree[i] || joins || is_crowded_in) << round << ' ' << i;
    }
  }
  EXPECT_GT(supported - joined - crowded, seeds / 10);  // all answers occur
  EXPECT_GT(std::min(joined, crowded), seeds / 20);
  EXPECT_LT(supported, seeds * 9 / 10);
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
    motion.neighbours_agree = true;
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
  MotionVotesOptions options;
  options.min_share = 1.5;
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                               "got min_share");
  // The message names the option alone, not the others.
  options = {};
  options.join_radius_px = 1001;
  testing::expect_error<std::invalid_argument>([&] { support_seeds(features, options, motions); },
                                               "got join_radius_px = 1001; want 1 to 1000");
}

}  // namespace
}  // namespace dynfilter
