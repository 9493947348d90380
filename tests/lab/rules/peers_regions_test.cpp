// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/rules that find moving regions of an image by depth or by brightness. Each is
// compared with a naive reading of its description on random frames, and with cases made by hand.

#include "lab/rules/depth_consistency.hpp"
#include "lab/rules/region_bayes.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/pair_scene.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

// --- DepthConsistency ----------------------------------------------------------------------------

/// Wall at 4 m that fills both images, with a grid of features.
PairScene wall() {
  PairScene scene;
  scene.frame.depth.setTo(4);
  for (int y = 4; y < 120; y += 8) {
    for (int x = 4; x < 160; x += 8) {
      scene.features.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
  scene.tracks.resize(scene.features.size());
  return scene;
}

/// Verdicts on the frame after the wall was seen in five frames.
FeatureLabels after_five_walls(const PairScene& scene) {
  peers::DepthKeyframes memory;
  peers::DepthConsistencyOptions options;
  options.frames_per_keyframe = 1;
  const peers::DepthConsistency rule(memory, options);
  for (int k = 0; k < 5; ++k) EXPECT_EQ(wall().labels(rule).statistics().removed(), 0U);
  return scene.labels(rule);
}

TEST(DepthConsistency, RemovesWhatCameBeforeTheWall) {
  PairScene scene = wall();
  const cv::Rect person(50, 30, 60, 60);
  scene.frame.depth(person).setTo(2);
  const FeatureLabels labels = after_five_walls(scene);
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    const cv::Point2f at = scene.features[i];
    EXPECT_TRUE(labels.is_removed(i) || !person.contains(at)) << at;
    const cv::Rect dilated(34, 14, 92, 92);
    EXPECT_TRUE(!labels.is_removed(i) || dilated.contains(at)) << at;
  }
}

TEST(DepthConsistency, KeepsTheWallWhatIsBehindItAndThinThings) {
  EXPECT_EQ(after_five_walls(wall()).statistics().removed(), 0U);
  PairScene behind = wall();
  behind.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(6);
  EXPECT_EQ(after_five_walls(behind).statistics().removed(), 0U);
  PairScene thin = wall();  // no window lies on it
  thin.frame.depth(cv::Rect(70, 0, 20, 120)).setTo(2);
  EXPECT_EQ(after_five_walls(thin).statistics().removed(), 0U);
}

TEST(DepthConsistency, GapMustExceedSixTenthsOfAMetre) {
  const auto removed_at = [](double depth_m) {
    PairScene scene = wall();
    scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(depth_m);
    return after_five_walls(scene).statistics().removed();
  };
  EXPECT_EQ(removed_at(3.41), 0U);
  EXPECT_GT(removed_at(3.39), 0U);
}

TEST(DepthConsistency, BeginsWithFiveKeyframesAndForgetsThemWithoutAPose) {
  PairScene scene = wall();
  scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(2);
  peers::DepthKeyframes memory;
  const peers::DepthConsistency rule(memory);  // a keyframe every second frame
  for (int k = 0; k < 8; ++k) EXPECT_EQ(wall().labels(rule).statistics().removed(), 0U);
  EXPECT_EQ(memory.list.size(), 4U);
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U) << "makes the fifth";
  EXPECT_GT(scene.labels(rule).statistics().removed(), 0U);
  scene.pose.reset();
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U);
  EXPECT_EQ(memory.list.size(), 1U);
}

TEST(DepthConsistency, ComparesWithTheFarthestKeyframes) {
  peers::DepthKeyframes memory;
  memory.list.resize(4);
  memory.list[0].from_now.translation = {0.1, 0, 0};
  memory.list[1].from_now.translation = {0.4, 0, 0};
  memory.list[2].from_now.translation = {0.2, 0, 0};
  // A turn of 0.5, the largest: 0.3 * 1 + 0.7 * 0.2 / 0.4 exceeds 0.7 * 0.1 / 0.4.
  memory.list[2].from_now.rotation =
      cv::Matx33d(std::cos(0.5), -std::sin(0.5), 0, std::sin(0.5), std::cos(0.5), 0, 0, 0, 1);
  peers::DepthConsistencyOptions options;
  options.references = 2;
  const auto chosen = peers::DepthConsistency(memory, options).chosen_references();
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_EQ(chosen[0], &memory.list[1]);
  EXPECT_EQ(chosen[1], &memory.list[2]);
}

/// Reading of the description for one keyframe: the pixels of grown regions.
cv::Mat1b depth_reading(const PairScene& scene, const peers::DepthKeyframes::Keyframe& keyframe,
                        const peers::DepthConsistencyOptions& options) {
  const cv::Mat1f depth = scene.frame.depth;
  const int reach = options.reach_px;
  cv::Mat1b region(depth.size(), std::uint8_t{0});
  const cv::Vec3d camera_now = keyframe.from_now.translation;
  for (const cv::Point3d& point : keyframe.points) {
    const cv::Vec3d ray(point), ray_now = cv::Vec3d(point) - camera_now;
    const double angle = std::acos(ray.dot(ray_now) / cv::norm(ray) / cv::norm(ray_now));
    if (angle * 180 / CV_PI > 30) continue;
    const cv::Vec3d now = keyframe.from_now.rotation.inv() * ray_now;
    if (now[2] <= 0 || now[2] >= 7) continue;
    const double u = 120 * now[0] / now[2] + 80, v = 120 * now[1] / now[2] + 60;
    if (u < reach + 1 || v < reach + 1 || u >= 159 - reach || v >= 119 - reach) continue;
    const cv::Point seed(static_cast<int>(std::floor(u + 0.5)),
                         static_cast<int>(std::floor(v + 0.5)));
    if (depth(seed) <= 0) continue;
    std::vector<double> around;
    for (int y = std::max(0, seed.y - reach); y <= std::min(119, seed.y + reach); ++y) {
      for (int x = std::max(0, seed.x - reach); x <= std::min(159, seed.x + reach); ++x) {
        if (depth(y, x) > 0) around.push_back(double{depth(y, x)});
      }
    }
    double mean = 0, variance = 0, closest = -1;
    for (const double z : around) mean += z / static_cast<double>(around.size());
    for (const double z : around) {
      variance += (z - mean) * (z - mean) / static_cast<double>(around.size());
      if (z < now[2]) closest = std::max(closest, z);
    }
    if (closest < 0 || now[2] - closest <= 0.6 || variance >= options.max_variance_m2) continue;
    if (region(seed) != 0) continue;
    std::deque<cv::Point> waiting{seed};
    std::vector<double> members{double{depth(seed)}};
    region(seed) = 255;
    while (!waiting.empty()) {
      const cv::Point at = waiting.front();
      waiting.pop_front();
      for (const cv::Point& next : {cv::Point(at.x + 1, at.y), cv::Point(at.x - 1, at.y),
                                    cv::Point(at.x, at.y + 1), cv::Point(at.x, at.y - 1)}) {
        if (next.x < 0 || next.y < 0 || next.x > 159 || next.y > 119) continue;
        if (region(next) != 0 || depth(next) <= 0) continue;
        double sum = 0;
        for (const double z : members) sum += z;
        const double z = double{depth(next)};
        if (std::abs(z - sum / static_cast<double>(members.size())) >= 0.2) continue;
        region(next) = 255;
        members.push_back(z);
        waiting.push_back(next);
      }
    }
  }
  return region;
}

TEST(DepthConsistency, EqualsTheReadingOnRandomFrames) {
  std::size_t found = 0, empty = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    ByteSource source(seed);
    PairScene scene = arbitrary_pair(seed, 10);
    cv::Mat1f depth = scene.frame.depth;
    depth.setTo(3.5);
    for (int k = 0; k < 6; ++k) {  // boxes of a slanted depth
      const cv::Rect box(source.between(0, 120), source.between(0, 90), source.between(5, 40),
                         source.between(5, 30));
      const double z = uniform(source, 0.8, 4), slant = uniform(source, 0, 0.01);
      for (int y = box.y; y < box.y + box.height; ++y) {
        for (int x = box.x; x < box.x + box.width; ++x) {
          depth(y, x) = source.chance(5) ? 0 : static_cast<float>(z + slant * (x - box.x));
        }
      }
    }
    peers::DepthConsistencyOptions options;
    options.reach_px = 4;
    options.max_variance_m2 = 0.02;
    options.dilation_px = 0;
    peers::DepthKeyframes memory;
    memory.list.resize(1);
    memory.list[0].from_now = *scene.pose;
    memory.list[0].from_now.translation *= source.chance(30) ? 20 : 1;  // a large parallax
    for (int k = 0; k < 80; ++k) {
      const double z = uniform(source, 0.8, 8);
      memory.list[0].points.emplace_back(uniform(source, -0.7, 0.7) * z,
                                         uniform(source, -0.6, 0.6) * z, z);
    }
    const FilterInput input{scene.frame, scene.segmentation, scene.features};
    const peers::FramePair pair{input,          scene.camera, scene.frame.image,
                                &scene.earlier, scene.tracks, scene.pose};
    const peers::DepthConsistency rule(memory, options);
    const cv::Mat mask = rule.mask(pair, rule.chosen_references());
    const cv::Mat1b expected = depth_reading(scene, memory.list[0], options);
    ASSERT_EQ(cv::countNonZero(mask != expected), 0) << "seed " << seed;
    ++(cv::countNonZero(expected) > 0 ? found : empty);
  }
  EXPECT_GT(found, 20U);
}

// --- RegionBayes ---------------------------------------------------------------------------------

/// Textured wall at 2 m before a camera that moves 0.05 m to the side: 3 px. `at` a card of its own
/// texture, which moved `shift_px` in the image besides.
PairScene textured_wall(int shift_px) {
  PairScene scene;
  scene.move_camera({0.05, 0, 0});
  scene.frame.depth.setTo(2);
  const cv::Mat1b picture = texture({200, 160}, 3), card = texture({60, 60}, 4);
  picture(cv::Rect(20, 20, 160, 120)).copyTo(scene.frame.image);
  picture(cv::Rect(17, 20, 160, 120)).copyTo(scene.earlier.frame.image);
  card.copyTo(scene.frame.image(cv::Rect(60, 40, 60, 60)));
  card.copyTo(scene.earlier.frame.image(cv::Rect(63 + shift_px, 40, 60, 60)));
  for (int y = 10; y < 120; y += 20) {
    for (int x = 10; x < 160; x += 20) {
      scene.features.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
  scene.tracks.resize(scene.features.size());
  return scene;
}

TEST(RegionBayes, RemovesACardThatMovesAndKeepsTheWall) {
  const PairScene scene = textured_wall(12);
  peers::RegionBeliefs memory;
  const FeatureLabels labels = scene.labels(peers::RegionBayes(memory));
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    const cv::Point2f at = scene.features[i];
    const bool is_on_card = cv::Rect(60, 40, 60, 60).contains(at);
    const bool is_uncovered = cv::Rect(120, 40, 20, 60).contains(at);  // seen before by the card
    EXPECT_TRUE(is_uncovered || labels.is_removed(i) == is_on_card) << at;
  }
}

TEST(RegionBayes, KeepsACardThatMovesAsTheWallDoes) {
  peers::RegionBeliefs memory;
  EXPECT_EQ(textured_wall(0).labels(peers::RegionBayes(memory)).statistics().removed(), 0U);
}

TEST(RegionBayes, BeliefsFadeWithoutEvidenceAndStartAnew) {
  peers::RegionBeliefs memory;
  const peers::RegionBayes rule(memory);
  PairScene scene = textured_wall(12);
  scene.labels(rule);
  const double before = memory.log_odds(2, 4);
  EXPECT_EQ(before, 3) << "the limit";
  scene.pose.reset();
  EXPECT_GT(scene.labels(rule).statistics().removed(), 0U);
  EXPECT_DOUBLE_EQ(memory.log_odds(2, 4), 0.7 * before);
  scene.has_earlier = false;
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U);
  EXPECT_EQ(memory.log_odds(2, 4), 0);
}

/// Beliefs after one more frame, cell by cell.
void region_reading(const PairScene& scene, const peers::RegionBayesOptions& o,
                    cv::Mat1d& beliefs) {
  const cv::Mat1b now = scene.frame.image, then = scene.earlier.frame.image;
  for (int row = 0; row < beliefs.rows; ++row) {
    for (int column = 0; column < beliefs.cols; ++column) {
      double plain = 0, compensated = 0, samples = 0;
      for (int y = row * o.cell_px; y < std::min(120, (row + 1) * o.cell_px); y += o.step_px) {
        for (int x = column * o.cell_px; x < std::min(160, (column + 1) * o.cell_px);
             x += o.step_px) {
          const auto z = scene.frame.depth_m({x, y});
          if (!z || x > 158 || y > 118) continue;
          const cv::Vec3d point((x - 80) / 120. * *z, (y - 60) / 120. * *z, *z);
          const cv::Vec3d moved = scene.pose->rotation * point + scene.pose->translation;
          const double u = 120 * moved[0] / moved[2] + 80, v = 120 * moved[1] / moved[2] + 60;
          if (!(u >= 0 && v >= 0 && u < 159 && v < 119)) continue;
          const int left = static_cast<int>(u), top = static_cast<int>(v);
          const double a = u - left, b = v - top;
          const double seen = (1 - a) * (1 - b) * then(top, left) +
                              a * (1 - b) * then(top, left + 1) +
                              (1 - a) * b * then(top + 1, left) + a * b * then(top + 1, left + 1);
          compensated += std::abs(now(y, x) - seen);
          plain += std::abs(now(y, x) - then(y, x));
          ++samples;
        }
      }
      double evidence = 0;
      if (samples >= o.min_samples) {
        const double d = std::min(plain, compensated) / samples;
        const double below = std::max(0.0, o.moving_mean - d) / o.moving_deviation;
        const double above = std::max(0.0, d - o.static_mean) / o.static_deviation;
        const double likelihoods = std::exp(-below * below / 2) / o.moving_deviation /
                                   (std::exp(-above * above / 2) / o.static_deviation);
        evidence = std::log(likelihoods);
      }
      beliefs(row, column) = std::max(-3.0, std::min(3.0, 0.7 * beliefs(row, column) + evidence));
    }
  }
}

TEST(RegionBayes, EqualsTheReadingOnRandomFrames) {
  peers::RegionBeliefs memory;
  const peers::RegionBayesOptions options;
  const peers::RegionBayes rule(memory, options);
  cv::Mat1d beliefs(6, 8, 0.0);
  std::size_t removals = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    PairScene scene = arbitrary_pair(seed);
    cv::RNG random(seed + 5);
    random.fill(scene.frame.depth, cv::RNG::UNIFORM, 0.5, 4);
    scene.frame.depth(cv::Rect(20, 40, 30, 40)).setTo(0);
    scene.frame.depth(cv::Rect(0, 80, 20, 20)).setTo(0);  // of a region, 2 to 6 pixels have depth
    for (int k = 0; k < 2 + static_cast<int>(seed % 5); ++k) {
      scene.frame.depth.at<float>(84 + 4 * (k / 3), 4 + 4 * (k % 3)) = 2;
    }
    // From dull to lively, so that all strengths of evidence occur.
    cv::Mat1b picture = texture({160, 120}, seed);
    picture = picture / static_cast<double>(1 + seed % 5);
    picture.copyTo(scene.frame.image);
    cv::Mat1b before = texture({160, 120}, seed + (seed % 2) * 100);
    before = before / static_cast<double>(1 + seed % 5);
    before.copyTo(scene.earlier.frame.image);
    const FeatureLabels labels = scene.labels(rule);
    region_reading(scene, options, beliefs);
    ASSERT_LT(cv::norm(memory.log_odds, beliefs, cv::NORM_INF), 1e-3) << "seed " << seed;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::Point pixel = nearest_pixel(scene.features[i]);
      const bool is_inside = cv::Rect(0, 0, 160, 120).contains(pixel);
      const bool expected = is_inside && memory.log_odds(pixel.y / 20, pixel.x / 20) > 0;
      ASSERT_EQ(labels.is_removed(i), expected) << "seed " << seed;
      ++(expected ? removals : kept);
    }
  }
  EXPECT_GT(removals, 200U);
  EXPECT_GT(kept, 200U);
}

TEST(PeersOfRegions, RefuseOptionsOutOfRange) {
  peers::DepthKeyframes keyframes;
  peers::DepthConsistencyOptions depth;
  depth.references = 0;
  expect_error<std::invalid_argument>([&] { peers::DepthConsistency(keyframes, depth); },
                                      "must be 1 or more");
  depth = {};
  depth.reach_px = depth.dilation_px = 0;
  depth.min_gap_m = depth.max_variance_m2 = depth.growth_m = 0;
  EXPECT_NO_THROW(peers::DepthConsistency(keyframes, depth));
  peers::RegionBeliefs beliefs;
  peers::RegionBayesOptions regions;
  regions.prior = 1;
  expect_error<std::invalid_argument>([&] { peers::RegionBayes(beliefs, regions); },
                                      "between 0 and 1");
}

}  // namespace
}  // namespace dynfilter::testing
