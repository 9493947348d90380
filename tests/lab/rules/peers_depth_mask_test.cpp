// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/rules that compute a mask from depth, and the clustering that one of them needs.

#include "lab/rules/box_depth_mask.hpp"
#include "lab/rules/dbscan.hpp"
#include "lab/rules/support.hpp"

#include <numeric>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support/byte_source.hpp"
#include "support/peer_scene.hpp"

namespace dynfilter::testing {
namespace {

// --- BoxDepthMask --------------------------------------------------------------------------------

const cv::Rect body(50, 30, 40, 60);

/// Flat person at 1.5 m who fills the box.
PeerScene flat_person() {
  PeerScene scene;
  scene.fill(body, 1.5);
  scene.add_box(body);
  return scene;
}

TEST(BoxDepthMask, RemovesThePersonAndThreePixelsAround) {
  const PeerScene scene = flat_person();
  const peers::BoxDepthMask rule;
  EXPECT_EQ(scene.verdicts(rule, {{47, 50}, {46, 50}, {92, 50}, {93, 50}}), "xoxo");
  EXPECT_EQ(scene.verdicts(rule, {{70, 27}, {70, 26}, {70, 92}, {70, 93}}), "xoxo");
  EXPECT_EQ(scene.verdicts(rule, {{47, 27}}), "x") << "the structuring element is square";
}

TEST(BoxDepthMask, UsesTheMeanOfMedianAndLowPercentile) {
  PeerScene scene = flat_person();
  scene.fill({50, 30, 18, 60}, 1.9);
  scene.fill({68, 30, 14, 60}, 1.4);  // 35 % of the box: the 33rd percentile
  scene.fill({82, 30, 4, 60}, 1.5);
  scene.fill({86, 30, 4, 60}, 1.6);  // from 45 to 55 %: the median; the mean of the two is 1.5
  const auto verdict_at = [&](double metres) {
    PeerScene with_limb = scene;
    with_limb.fill({90, 50, 15, 1}, metres);
    return with_limb.verdicts(peers::BoxDepthMask(), {{100, 50}});
  };
  EXPECT_EQ(verdict_at(1.829), "x");
  EXPECT_EQ(verdict_at(1.831), "o");
  EXPECT_EQ(verdict_at(1.171), "x");
  EXPECT_EQ(verdict_at(1.169), "o");
}

TEST(BoxDepthMask, FollowsTheBodyThirtyPixelsBeyondTheBox) {
  PeerScene scene = flat_person();
  scene.fill({90, 50, 60, 10}, 1.5);  // dilation adds 3 pixels
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{122, 55}, {123, 55}}), "xo");
}

TEST(BoxDepthMask, KeepsOnlyTheLargestComponent) {
  PeerScene scene = flat_person();
  scene.fill({91, 40, 20, 20}, 1.5);  // a column of wall separates it
  scene.fill({90, 90, 20, 20}, 1.5);  // touches only at a corner
  const peers::BoxDepthMask rule;
  EXPECT_EQ(scene.verdicts(rule, {{70, 60}, {100, 50}, {100, 100}}), "xoo");
  scene.fill({90, 50, 1, 1}, 1.5);  // a bridge
  EXPECT_EQ(scene.verdicts(rule, {{70, 60}, {100, 50}, {100, 100}}), "xxo");
}

TEST(BoxDepthMask, SkipsABoxWithTooLittleDepth) {
  PeerScene scene = flat_person();
  scene.fill({50, 30, 12, 60}, 0);  // 30 % of the box
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{70, 60}, {55, 60}}), "xo");
  scene.fill({62, 30, 1, 1}, 0);
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{70, 60}}), "o");
  peers::BoxDepthMaskOptions options;
  options.min_depth_share = 0;
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(options), {{70, 60}}), "x");
  scene.frame.depth.setTo(0);
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(options), {{70, 60}}), "o");
  scene.frame.depth = cv::Mat();
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(options), {{70, 60}}), "o");
}

TEST(BoxDepthMask, DropsAMaskOfMoreThanFourFifthsOfTheImage) {
  const auto verdict_with_columns = [](int columns) {
    PeerScene scene;
    scene.fill({0, 0, columns, 120}, 1.5);
    scene.add_box({-10, -10, columns + 10, 150});
    return scene.verdicts(peers::BoxDepthMask(), {{20, 20}});
  };
  EXPECT_EQ(verdict_with_columns(125), "x") << "dilated, 128 of 160 columns";
  EXPECT_EQ(verdict_with_columns(126), "o");
}

TEST(BoxDepthMask, TakesSharesFromNoneToAll) {
  peers::BoxDepthMaskOptions options;
  options.min_depth_share = options.low_quantile = 0;
  options.max_image_share = 1;
  EXPECT_NO_THROW(peers::BoxDepthMask{options});
  options.max_image_share = 1.01;
  EXPECT_THROW(peers::BoxDepthMask{options}, std::invalid_argument);
}

TEST(BoxDepthMask, UnitesTheMasksOfTwoPersons) {
  PeerScene scene = flat_person();
  scene.fill({5, 5, 20, 80}, 2.5);
  scene.add_box({5, 5, 20, 80});
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{70, 60}, {15, 40}, {35, 40}}), "xxo");
}

// --- DBSCAN --------------------------------------------------------------------------------------

std::vector<cv::Point3f> on_a_line(const std::vector<float>& xs) {
  std::vector<cv::Point3f> points;
  for (const float x : xs) points.emplace_back(x, 7.0F, 0.0F);
  return points;
}

TEST(Dbscan, CountsThePointItselfAndPointsOnTheRadius) {
  EXPECT_EQ(peers::dbscan(on_a_line({0, 1, 2, 3}), 5, 4), std::vector<int>({0, 0, 0, 0}));
  EXPECT_EQ(peers::dbscan(on_a_line({0, 1, 2}), 5, 4), std::vector<int>({-1, -1, -1}));
  EXPECT_EQ(peers::dbscan(on_a_line({0, 1, 2, 5}), 5, 4), std::vector<int>({0, 0, 0, 0}));
  EXPECT_EQ(peers::dbscan(on_a_line({0, 1, 2, 7.125F}), 5, 4), std::vector<int>(4, -1));
  EXPECT_EQ(peers::dbscan({}, 5, 4), std::vector<int>());
}

TEST(Dbscan, BorderPointGoesToTheLowerCluster) {
  // The middle point counts itself and two neighbours: it is no core point and joins no clusters.
  EXPECT_EQ(peers::dbscan(on_a_line({20, 19, 18, 15, 10, 12, 11, 10.5F}), 5, 4),
            std::vector<int>({0, 0, 0, 0, 0, 0, 0, 0}))
      << "six points lie within 5 of 15";
  EXPECT_EQ(peers::dbscan(on_a_line({20, 21, 22, 20.5F, 15, 10, 9, 8, 9.5F}), 5, 4),
            std::vector<int>({0, 0, 0, 0, 0, 1, 1, 1, 1}));
}

TEST(Dbscan, ComparesAllThreeCoordinates) {
  std::vector<cv::Point3f> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 5}};
  EXPECT_EQ(peers::dbscan(points, 5, 4), std::vector<int>({0, 0, 0, 0}));
  points[3].z = 5.125F;
  EXPECT_EQ(peers::dbscan(points, 5, 4), std::vector<int>(4, -1));
}

bool within(const cv::Point3f& a, const cv::Point3f& b, double radius) {
  return std::pow(double{a.x} - b.x, 2) + std::pow(double{a.y} - b.y, 2) +
             std::pow(double{a.z} - b.z, 2) <=
         radius * radius;
}

/// Oracle by the definition: core points within the radius of each other share a cluster, named
/// after its first core point; each other point is in the lowest cluster with a core point within
/// the radius.
std::vector<int> oracle_dbscan(const std::vector<cv::Point3f>& points, double radius,
                               std::size_t min_points) {
  const std::size_t count = points.size();
  std::vector<std::size_t> cores;
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t near_by = 0;
    for (const cv::Point3f& other : points) near_by += within(points[i], other, radius) ? 1 : 0;
    if (near_by >= min_points) cores.push_back(i);
  }
  std::vector<std::size_t> first_core(count);
  std::iota(first_core.begin(), first_core.end(), std::size_t{0});
  for (bool changed = true; changed;) {
    changed = false;
    for (const std::size_t i : cores) {
      for (const std::size_t j : cores) {
        if (!within(points[i], points[j], radius) || first_core[j] <= first_core[i]) continue;
        first_core[j] = first_core[i];
        changed = true;
      }
    }
  }
  std::vector<std::size_t> names;  // ascending, since the cores are
  for (const std::size_t i : cores) {
    if (first_core[i] == i) names.push_back(i);
  }
  std::vector<int> clusters(count, -1);
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t lowest = count;
    for (const std::size_t core : cores) {
      if (within(points[i], points[core], radius)) lowest = std::min(lowest, first_core[core]);
    }
    const auto name = std::find(names.begin(), names.end(), lowest);
    if (name != names.end()) clusters[i] = static_cast<int>(name - names.begin());
  }
  return clusters;
}

TEST(LargestAtDepth, PaintsNothingWhereNothingIsAtTheDepth) {
  const PeerScene scene = flat_person();
  cv::Mat canvas = cv::Mat::zeros(scene.frame.depth.size(), CV_8UC1);
  peers::paint_largest_at_depth(scene.frame, body, 1.0, 0.1, canvas);
  EXPECT_EQ(cv::countNonZero(canvas), 0);
  peers::paint_largest_at_depth(scene.frame, body, 1.5, 0.1, canvas);
  EXPECT_EQ(cv::countNonZero(canvas), body.area());
}

TEST(Dbscan, MatchesTheDefinition) {
  int clusters = 0, noise = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const int extent = source.between(4, 60);
    std::vector<cv::Point3f> points(static_cast<std::size_t>(source.between(0, 80)));
    for (cv::Point3f& point : points) {
      // Few distinct values, so that exact distances and equal points are common.
      point.x = static_cast<float>(source.between(-extent, extent)) / 2;
      point.y = static_cast<float>(source.between(-extent, extent)) / 2;
      point.z = static_cast<float>(source.between(0, 4));
    }
    const double radius = source.between(1, 10) / 2.0;
    const auto min_points = static_cast<std::size_t>(source.between(1, 6));
    const std::vector<int> expected = oracle_dbscan(points, radius, min_points);
    ASSERT_EQ(peers::dbscan(points, radius, min_points), expected) << "seed " << seed;
    for (const int cluster : expected) {
      clusters = std::max(clusters, cluster + 1);
      noise += cluster < 0 ? 1 : 0;
    }
  }
  EXPECT_GT(clusters, 20);
  EXPECT_GT(noise, 1000);
}

}  // namespace
}  // namespace dynfilter::testing
