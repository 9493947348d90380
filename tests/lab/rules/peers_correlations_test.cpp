// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rule in src/rules that judges distances between tracked points. Each is compared with a naive
// reading of its description on random frames, and with cases made by hand.

#include "lab/rules/point_correlations.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/pair_scene.hpp"

namespace dynfilter::testing {
namespace {

constexpr std::uint64_t cases = 300;

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

/// Edges of the Delaunay triangulation: triangles without a point in their circumcircle. The last
/// three points are the corners of OpenCV's outer triangle.
std::set<std::pair<std::size_t, std::size_t>> delaunay_edges(std::vector<cv::Point2d> points) {
  const std::size_t count = points.size();
  const double far = 3 * 160;
  points.insert(points.end(), {{far, 0}, {0, far}, {-far, -far}});
  std::set<std::pair<std::size_t, std::size_t>> edges;
  for (std::size_t a = 0; a < points.size(); ++a) {
    for (std::size_t b = a + 1; b < points.size(); ++b) {
      for (std::size_t c = b + 1; c < points.size(); ++c) {
        const cv::Point2d ab = points[b] - points[a], ac = points[c] - points[a];
        const double d = 2 * ab.cross(ac);
        if (d == 0) continue;
        const cv::Point2d centre((ac.y * ab.dot(ab) - ab.y * ac.dot(ac)) / d,
                                 (ab.x * ac.dot(ac) - ac.x * ab.dot(ab)) / d);
        bool is_empty = true;
        for (std::size_t p = 0; p < points.size() && is_empty; ++p) {
          is_empty = p == a || p == b || p == c ||
                     cv::norm(points[p] - points[a] - centre) > cv::norm(centre);
        }
        if (!is_empty) continue;
        if (b < count) edges.insert({a, b});
        if (c < count) edges.insert({{a, c}, {b, c}});
      }
    }
  }
  return edges;
}

TEST(PointCorrelations, EqualsTheReadingOnRandomFrames) {
  std::size_t removals = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < cases; ++seed) {
    const PairScene scene = arbitrary_pair(seed, 28);
    peers::PointCorrelationsOptions options;
    options.max_change_m = seed % 3 == 0 ? 0.02 : 0.01;
    options.max_deviations = seed % 3 == 0 ? 3 : 0.5;
    const auto in_space = [](cv::Point2f at, double z) {
      return cv::Point3d((at.x - 80) / 120 * z, (at.y - 60) / 120 * z, z);
    };
    std::vector<std::size_t> features;
    std::vector<cv::Point2d> pixels;
    std::vector<cv::Point3d> now, then;
    for (std::size_t i = 0; i < scene.features.size(); ++i) {
      const cv::Point2f at = scene.features[i], before = scene.tracks[i].position;
      const auto z = scene.frame.depth_m(nearest_pixel(at));
      const auto z_then = scene.earlier.frame.depth_m(nearest_pixel(before));
      const bool is_inside = at.x >= 0 && at.y >= 0 && at.x < 160 && at.y < 120;
      if (!scene.tracks[i].is_found || !z || !z_then || !is_inside) continue;
      features.push_back(i);
      pixels.emplace_back(at);
      now.push_back(in_space(at, *z));
      then.push_back(in_space(before, *z_then));
    }
    std::vector<std::size_t> part(features.size());
    for (std::size_t k = 0; k < part.size(); ++k) part[k] = k;
    for (const auto& [a, b] : delaunay_edges(pixels)) {
      const double change = std::abs(cv::norm(now[a] - now[b]) - cv::norm(then[a] - then[b]));
      const double sa = 0.0025 * now[a].z * now[a].z, sb = 0.0025 * now[b].z * now[b].z;
      if (change > std::max(options.max_change_m, options.max_deviations * std::hypot(sa, sb)))
        continue;
      const std::size_t low = std::min(part[a], part[b]), high = std::max(part[a], part[b]);
      std::replace(part.begin(), part.end(), high, low);
    }
    std::size_t largest = 0;
    const auto size_of = [&](std::size_t p) { return std::count(part.begin(), part.end(), p); };
    for (std::size_t p = 0; p < part.size(); ++p) {
      if (size_of(p) > size_of(largest)) largest = p;
    }
    std::vector<bool> expected(scene.features.size());
    for (std::size_t k = 0; k < part.size(); ++k) expected[features[k]] = part[k] != largest;
    ASSERT_EQ(removed_by(peers::PointCorrelations(options), scene), expected) << "seed " << seed;
    for (const bool is_removed : expected) ++(is_removed ? removals : kept);
  }
  EXPECT_GT(removals, 300U);
  EXPECT_GT(kept, 500U);
}

TEST(PointCorrelations, RefusesOptionsOutOfRange) {
  peers::PointCorrelationsOptions options;
  options.max_change_m = -1;
  expect_error<std::invalid_argument>([&] { peers::PointCorrelations{options}; }, "max_change_m");
}

}  // namespace
}  // namespace dynfilter::testing
