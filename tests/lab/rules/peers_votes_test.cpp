// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/rules in which tracks vote on persons or clusters. Each is compared with a naive
// reading of its description on random frames, and with cases made by hand.

#include "lab/rules/cluster_votes.hpp"
#include "lab/rules/epipolar_vote.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/pair_scene.hpp"

namespace dynfilter::testing {
namespace {

constexpr std::uint64_t cases = 300;
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

TEST(EpipolarVote, OneOutlierBesideOnePersonRemovesAllUnlessEachHasVotes) {
  PairScene scene = room_with_person({0, 0, 0});
  scene.add({112, 60}, 1.3, {0, 0.08, 0});  // 13 px beside the mask
  scene.add_masked({5, 5, 20, 20});
  const std::size_t far_feature = 0;  // at (10, 10)
  peers::EpipolarVoteOptions options;
  const FeatureLabels together = scene.labels(peers::EpipolarVote(options));
  EXPECT_TRUE(together.is_removed(far_feature));
  EXPECT_TRUE(together.is_removed(scene.features.size() - 2));
  EXPECT_FALSE(together.is_removed(scene.features.size() - 1)) << "it is on no mask";
  options.per_instance = true;
  const FeatureLabels apart = scene.labels(peers::EpipolarVote(options));
  EXPECT_FALSE(apart.is_removed(far_feature));
  EXPECT_EQ(apart[scene.features.size() - 2].instance, 0);
  options.min_share = 0.3;
  EXPECT_EQ(scene.labels(peers::EpipolarVote(options)).statistics().removed(), 0U);
  options.min_share = 0;
  options.reach_px = 11;
  EXPECT_EQ(scene.labels(peers::EpipolarVote(options)).statistics().removed(), 0U);
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
  peers::EpipolarVoteOptions options;
  options.max_distance_px = 0.5;
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote(options)), "xxxxxxxx");
  scene.tracks[0].is_found = false;
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote(options)), "oooooooo");
}

/// Reading of the description, one feature after the other.
std::vector<bool> epipolar_reading(const PairScene& scene,
                                   const peers::EpipolarVoteOptions& options) {
  std::vector<bool> removed(scene.features.size());
  std::vector<std::size_t> used;
  std::vector<cv::Point2f> then, now;
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    const auto is_inside = [&](cv::Point2f at) {
      const cv::Point p = nearest_pixel(at);
      return p.x >= 5 && p.y >= 5 && p.x < 155 && p.y < 115;
    };
    if (!scene.tracks[i].is_found || !is_inside(scene.features[i]) ||
        !is_inside(scene.tracks[i].position)) {
      continue;
    }
    double sad = 0;
    for (int k = 0; k < 9; ++k) {
      const cv::Point offset(k % 3 - 1, k / 3 - 1);
      sad += std::abs(
          1.0 * scene.frame.image.at<std::uint8_t>(nearest_pixel(scene.features[i]) + offset) -
          scene.earlier.frame.image.at<std::uint8_t>(nearest_pixel(scene.tracks[i].position) +
                                                     offset));
    }
    if (sad > options.max_patch_sad) continue;
    used.push_back(i);
    then.push_back(scene.tracks[i].position);
    now.push_back(scene.features[i]);
  }
  if (used.size() < 8) return removed;
  const cv::Mat1d f = cv::findFundamentalMat(then, now, cv::FM_RANSAC, 0.1, 0.99);
  if (f.rows != 3) return removed;
  const auto& instances = scene.segmentation.instances;
  const auto votes_of = [&](const auto& is_person) {  // outliers and voters near person pixels
    std::pair<double, double> votes{0, 0};
    for (std::size_t k = 0; k < used.size(); ++k) {
      const double x = then[k].x, y = then[k].y;
      const double a = f(0, 0) * x + f(0, 1) * y + f(0, 2);
      const double b = f(1, 0) * x + f(1, 1) * y + f(1, 2);
      const double c = f(2, 0) * x + f(2, 1) * y + f(2, 2);
      const double distance = std::abs(a * now[k].x + b * now[k].y + c) / std::sqrt(a * a + b * b);
      bool is_near = false;
      for (int dy = -15; dy <= 15; ++dy) {
        for (int dx = -15; dx <= 15; ++dx) {
          const cv::Point p = nearest_pixel(now[k]) + cv::Point(dx, dy);
          is_near = is_near || (image_area.contains(p) && is_person(p));
        }
      }
      votes.second += is_near;
      votes.first += is_near && distance > 1;
    }
    return votes;
  };
  const auto apply = [&](const auto& is_person) {
    const auto [outliers, voters] = votes_of(is_person);
    if (outliers < 1 || outliers < options.min_share * voters) return;
    for (std::size_t i = 0; i < removed.size(); ++i) {
      const cv::Point p = nearest_pixel(scene.features[i]);
      if (image_area.contains(p) && is_person(p)) removed[i] = true;
    }
  };
  const auto is_on_person = [&](cv::Point p) {
    return std::any_of(instances.begin(), instances.end(),
                       [&](const Instance& one) { return one.class_id == 0 && is_on(one, p); });
  };
  if (!options.per_instance) apply(is_on_person);
  for (const Instance& one : instances) {
    if (options.per_instance && one.class_id == 0) {
      apply([&](cv::Point p) { return is_on(one, p); });
    }
  }
  return removed;
}

TEST(EpipolarVote, EqualsTheReadingOnRandomFrames) {
  std::size_t removals = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < cases; ++seed) {
    PairScene scene = arbitrary_pair(seed);
    cv::RNG noise(seed + 1);
    noise.fill(scene.frame.image, cv::RNG::UNIFORM, 0, 256);
    noise.fill(scene.earlier.frame.image, cv::RNG::UNIFORM, 0, 256);
    peers::EpipolarVoteOptions options;
    options.max_patch_sad = 900;
    options.per_instance = seed % 2 == 1;
    options.min_share = seed % 4 == 3 ? 0.4 : 0;
    const auto expected = epipolar_reading(scene, options);
    ASSERT_EQ(removed_by(peers::EpipolarVote(options), scene), expected) << "seed " << seed;
    for (const bool is_removed : expected) ++(is_removed ? removals : kept);
  }
  EXPECT_GT(removals, 300U);
  EXPECT_GT(kept, 500U);
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
  const auto removed_with = [](std::size_t still, std::size_t min_votes) {
    PairScene scene = room_with_person({0.1, 0, 0});
    for (std::size_t k = 0; k < still; ++k) {
      scene.add({70, 46 + 8 * static_cast<float>(k)}, 1.2);
    }
    peers::ClusterVotesOptions options;
    options.min_votes = min_votes;
    return scene.labels(peers::ClusterVotes(options)).statistics().removed();
  };
  EXPECT_EQ(removed_with(4, 100), 20U) << "16 of 20";
  EXPECT_EQ(removed_with(5, 100), 0U) << "16 of 21";
  EXPECT_EQ(removed_with(5, 16), 21U);
}

TEST(ClusterVotes, EqualsTheReadingOnRandomFrames) {
  std::size_t removals = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < cases; ++seed) {
    const PairScene scene = arbitrary_pair(seed);
    peers::ClusterVotesOptions options;
    options.radius_m = 0.4;
    options.min_points = 3;
    options.min_share = seed % 2 == 0 ? 0.8 : 0.3;
    // Space: point now, and how far it was from there, if known.
    struct Point {
      std::size_t feature;
      cv::Point3d now;
      double moved_m;
    };
    std::vector<Point> points;
    for (std::size_t i = 0; i < scene.features.size(); ++i) {
      const auto z = scene.frame.depth_m(nearest_pixel(scene.features[i]));
      if (!z) continue;
      const auto in_space = [](cv::Point2f at, double depth) {
        return cv::Point3d((at.x - 80) / 120 * depth, (at.y - 60) / 120 * depth, depth);
      };
      Point point{i, in_space(scene.features[i], *z), -1};
      const auto z_then = scene.earlier.frame.depth_m(nearest_pixel(scene.tracks[i].position));
      if (scene.tracks[i].is_found && z_then) {
        const cv::Vec3d then(in_space(scene.tracks[i].position, *z_then));
        const cv::Vec3d expected =
            scene.pose->rotation * cv::Vec3d(point.now) + scene.pose->translation;
        point.moved_m = cv::norm(then - expected);
      }
      points.push_back(point);
    }
    const auto are_near = [&](const Point& a, const Point& b) {
      return cv::norm(a.now - b.now) <= 0.4;
    };
    const auto is_core = [&](const Point& a) {
      return std::count_if(points.begin(), points.end(),
                           [&](const Point& b) { return are_near(a, b); }) >= 3;
    };
    std::vector<int> cluster(points.size(), -1);
    int next = 0;
    for (std::size_t first = 0; first < points.size(); ++first) {
      if (cluster[first] >= 0 || !is_core(points[first])) continue;
      cluster[first] = next;
      for (bool has_grown = true; has_grown;) {  // until nothing is in reach of a core point
        has_grown = false;
        for (std::size_t a = 0; a < points.size(); ++a) {
          if (cluster[a] != next || !is_core(points[a])) continue;
          for (std::size_t b = 0; b < points.size(); ++b) {
            if (cluster[b] >= 0 || !are_near(points[a], points[b])) continue;
            cluster[b] = next;
            has_grown = true;
          }
        }
      }
      ++next;
    }
    std::vector<bool> expected(scene.features.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      double voters = 0, votes = 0;
      for (std::size_t j = 0; j < points.size(); ++j) {
        if (cluster[j] != cluster[k] || points[j].moved_m < 0) continue;
        ++voters;
        votes += points[j].moved_m / 0.1 > 0.45;
      }
      if (cluster[k] < 0 || votes == 0 || votes < options.min_share * voters) continue;
      expected[points[k].feature] = true;
    }
    ASSERT_EQ(removed_by(peers::ClusterVotes(options), scene), expected) << "seed " << seed;
    for (const bool is_removed : expected) ++(is_removed ? removals : kept);
  }
  EXPECT_GT(removals, 300U);
  EXPECT_GT(kept, 500U);
}

// --- Options -------------------------------------------------------------------------------------

TEST(PeersOfVotes, RefuseOptionsOutOfRange) {
  peers::EpipolarVoteOptions votes;
  votes.min_outliers = 0;
  expect_error<std::invalid_argument>([&] { peers::EpipolarVote{votes}; },
                                      "min_outliers must be 1 or more");
  votes.confidence = 1;
  expect_error<std::invalid_argument>([&] { peers::EpipolarVote{votes}; },
                                      "confidence between 0 and 1");
  peers::ClusterVotesOptions clusters;
  clusters.radius_m = 0;
  expect_error<std::invalid_argument>([&] { peers::ClusterVotes{clusters}; }, "radius_m above 0");
  clusters = {};
  clusters.min_share = 0;
  expect_error<std::invalid_argument>([&] { peers::ClusterVotes{clusters}; }, "min_share above 0");
  clusters.min_share = 1;
  clusters.min_speed_m_s = 0;
  EXPECT_NO_THROW(peers::ClusterVotes{clusters});
}

}  // namespace
}  // namespace dynfilter::testing
