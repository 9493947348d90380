// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/rules that judge residual flow. Each is compared with a naive reading
// of its description on random frames, and with cases made by hand.

#include "lab/rules/flow_chi_square.hpp"
#include "lab/rules/flow_refined_mask.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/pair_scene.hpp"

namespace dynfilter::testing {
namespace {

constexpr std::uint64_t cases = 300;
const cv::Rect image_area(0, 0, 160, 120);

// --- FlowChiSquare -------------------------------------------------------------------------------

TEST(FlowChiSquare, RemovesWhatMovesAndKeepsWhatTheCameraExplains) {
  const PairScene moving = room_with_person({0.05, 0, 0});
  EXPECT_EQ(moving.verdicts(peers::FlowChiSquare()), room_kept(moving, 'x'));
  const PairScene still = room_with_person({0, 0, 0});
  EXPECT_EQ(still.verdicts(peers::FlowChiSquare()), room_kept(still, 'o'));
}

TEST(FlowChiSquare, ThresholdIsThatOfTwoDegreesOfFreedom) {
  peers::FlowChiSquareOptions options;
  options.depth_noise_at_1m_m = options.translation_noise_m = options.rotation_noise_rad = 0;
  options.track_noise_px = 0.5;
  const auto verdict_at = [&](double shift_px) {
    PairScene scene;
    scene.add({80, 60}, 2);
    scene.tracks[0].position.x += static_cast<float>(shift_px);
    return scene.verdicts(peers::FlowChiSquare(options));
  };
  EXPECT_EQ(verdict_at(0.5 * std::sqrt(9.21) - 0.001), "o");
  EXPECT_EQ(verdict_at(0.5 * std::sqrt(9.21) + 0.001), "x");
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
double chi_square_reading(const PairScene& scene, std::size_t i, double depth_m,
                          const peers::FlowChiSquareOptions& options) {
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
  const double z_noise = options.depth_noise_at_1m_m * depth_m * depth_m;
  const double t = options.translation_noise_m, w = options.rotation_noise_rad;
  const std::array<double, 7> deviations = {z_noise, t, t, t, w, w, w};
  cv::Matx22d covariance = cv::Matx22d::eye() * options.track_noise_px * options.track_noise_px;
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
  for (std::uint64_t seed = 0; seed < cases; ++seed) {
    const PairScene scene = arbitrary_pair(seed);
    const peers::FlowChiSquareOptions options;
    const std::vector<bool> removed = removed_by(peers::FlowChiSquare(), scene);
    for (std::size_t i = 0; i < removed.size(); ++i) {
      const cv::Point pixel = nearest_pixel(scene.features[i]);
      const auto depth_m = scene.frame.depth_m(pixel);
      if (!scene.tracks[i].is_found || !depth_m) {
        ASSERT_FALSE(removed[i]);
        continue;
      }
      const double value = chi_square_reading(scene, i, *depth_m, options);
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

TEST(FlowRefinedMask, EqualsTheReadingOnRandomFrames) {
  std::size_t removals = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < cases; ++seed) {
    const PairScene scene = arbitrary_pair(seed);
    const std::size_t count = scene.features.size();
    std::vector<int> motion(count, -1);  // -1 unknown, 0 still, 1 moves
    for (std::size_t i = 0; i < count; ++i) {
      const cv::Point2f at = scene.features[i];
      const auto z = scene.frame.depth_m(nearest_pixel(at));
      if (!scene.tracks[i].is_found || !z) continue;
      const cv::Vec3d point((at.x - 80) / 120 * *z, (at.y - 60) / 120 * *z, *z);
      const cv::Vec3d then = scene.pose->rotation * point + scene.pose->translation;
      const double dx = scene.tracks[i].position.x - (120 * then[0] / then[2] + 80);
      const double dy = scene.tracks[i].position.y - (120 * then[1] / then[2] + 60);
      motion[i] = std::sqrt(dx * dx + dy * dy) > 1 ? 1 : 0;
    }
    std::vector<bool> expected(count);
    for (const Instance& one : scene.segmentation.instances) {
      if (one.class_id != 0) continue;
      double known = 0, moving = 0;
      std::vector<std::size_t> found;
      for (std::size_t i = 0; i < count; ++i) {
        const cv::Point p = nearest_pixel(scene.features[i]);
        if (!image_area.contains(p)) continue;
        bool is_near = false;
        for (int dy = -20; dy <= 20; ++dy) {
          for (int dx = -20; dx <= 20; ++dx) {
            const cv::Point q = p + cv::Point(dx, dy);
            is_near = is_near || (image_area.contains(q) && is_on(one, q));
          }
        }
        if (is_on(one, p) || (is_near && motion[i] == 1)) found.push_back(i);
        known += is_on(one, p) && motion[i] >= 0;
        moving += is_on(one, p) && motion[i] == 1;
      }
      if (known > 0 && moving <= 0.3 * known) continue;
      for (const std::size_t i : found) expected[i] = true;
    }
    ASSERT_EQ(removed_by(peers::FlowRefinedMask(), scene), expected) << "seed " << seed;
    for (const bool is_removed : expected) ++(is_removed ? removals : kept);
  }
  EXPECT_GT(removals, 300U);
  EXPECT_GT(kept, 500U);
}

// --- Options -------------------------------------------------------------------------------------

TEST(PeersOfFlow, RefuseOptionsOutOfRange) {
  peers::FlowChiSquareOptions flow;
  flow.track_noise_px = 0;
  expect_error<std::invalid_argument>([&] { peers::FlowChiSquare{flow}; },
                                      "track_noise_px must be above 0");
  peers::FlowRefinedMaskOptions refined;
  refined.baseline_frames = 0;
  expect_error<std::invalid_argument>([&] { peers::FlowRefinedMask{refined}; },
                                      "baseline_frames must be 1 or more");
  refined = {};
  refined.min_flow_px = 0;
  refined.min_moving_share = 1;
  EXPECT_NO_THROW(peers::FlowRefinedMask{refined});
  refined.min_moving_share = 1.1;
  expect_error<std::invalid_argument>([&] { peers::FlowRefinedMask{refined}; },
                                      "min_moving_share 0 to 1");
}

}  // namespace
}  // namespace dynfilter::testing
