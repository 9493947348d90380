// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/lab/rules that compare images or depth, on frames made by hand; one of them
// beside a naive reading of its description on random frames.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lab/rules/person_rules.hpp"
#include "lab/rules/region_rules.hpp"
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

/// Verdicts on the frame after five keyframes of the wall, which are every second frame.
FeatureLabels after_walls(const PairScene& scene) {
  peers::DepthConsistency rule;
  for (int k = 0; k < 9; ++k) EXPECT_EQ(wall().labels(rule).statistics().removed(), 0U);
  return scene.labels(rule);
}

TEST(DepthConsistency, RemovesWhatCameBeforeTheWall) {
  PairScene scene = wall();
  const cv::Rect person(50, 30, 60, 60);
  scene.frame.depth(person).setTo(2);
  const FeatureLabels labels = after_walls(scene);
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    const cv::Point2f at = scene.features[i];
    EXPECT_TRUE(labels.is_removed(i) || !person.contains(at)) << at;
    const cv::Rect dilated(34, 14, 92, 92);
    EXPECT_TRUE(!labels.is_removed(i) || dilated.contains(at)) << at;
  }
}

TEST(DepthConsistency, KeepsTheWallWhatIsBehindItAndThinThings) {
  EXPECT_EQ(after_walls(wall()).statistics().removed(), 0U);
  PairScene behind = wall();
  behind.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(6);
  EXPECT_EQ(after_walls(behind).statistics().removed(), 0U);
  PairScene thin = wall();  // no window lies on it
  thin.frame.depth(cv::Rect(70, 0, 20, 120)).setTo(2);
  EXPECT_EQ(after_walls(thin).statistics().removed(), 0U);
}

TEST(DepthConsistency, GapMustExceedSixTenthsOfAMetre) {
  const auto removed_at = [](double depth_m) {
    PairScene scene = wall();
    scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(depth_m);
    return after_walls(scene).statistics().removed();
  };
  EXPECT_EQ(removed_at(3.41), 0U);
  EXPECT_GT(removed_at(3.39), 0U);
}

TEST(DepthConsistency, BeginsWithFiveKeyframesAndForgetsThemWithoutAPose) {
  PairScene scene = wall();
  scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(2);
  peers::DepthConsistency rule;
  for (int k = 0; k < 8; ++k) EXPECT_EQ(wall().labels(rule).statistics().removed(), 0U);
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U) << "makes the fifth";
  EXPECT_GT(scene.labels(rule).statistics().removed(), 0U);
  scene.pose.reset();
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U);
  scene.pose.emplace();
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U) << "forgotten";
}

TEST(DepthConsistency, ComparesWithTheFarthestKeyframes) {
  std::vector<peers::DepthConsistency::Keyframe> all(7);
  for (std::size_t k = 0; k < 7; ++k) {
    all[k].from_now.translation = {0.1 * static_cast<double>(7 - k), 0, 0};
  }
  // A turn, the largest, adds 0.3 to 0.7 * 0.15 / 0.7.
  all[6].from_now.translation = {0.15, 0, 0};
  all[6].from_now.rotation =
      cv::Matx33d(std::cos(0.5), -std::sin(0.5), 0, std::sin(0.5), std::cos(0.5), 0, 0, 0, 1);
  const auto chosen = peers::DepthConsistency::references(all);
  ASSERT_EQ(chosen.size(), 5U);
  const std::size_t expected[] = {0, 1, 2, 6, 3};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(chosen[k], &all[expected[k]]);
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
  const FeatureLabels labels = scene.labels(peers::RegionBayes());
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    const cv::Point2f at = scene.features[i];
    const bool is_on_card = cv::Rect(60, 40, 60, 60).contains(at);
    const bool is_uncovered = cv::Rect(120, 40, 20, 60).contains(at);  // seen before by the card
    EXPECT_TRUE(is_uncovered || labels.is_removed(i) == is_on_card) << at;
  }
}

TEST(RegionBayes, KeepsACardThatMovesAsTheWallDoes) {
  EXPECT_EQ(textured_wall(0).labels(peers::RegionBayes()).statistics().removed(), 0U);
}

TEST(RegionBayes, BeliefsFadeWithoutEvidenceAndStartAnew) {
  peers::RegionBayes rule;
  PairScene scene = textured_wall(12);
  scene.labels(rule);
  const double before = rule.log_odds()(2, 4);
  EXPECT_EQ(before, 3) << "the limit";
  scene.pose.reset();
  EXPECT_GT(scene.labels(rule).statistics().removed(), 0U);
  EXPECT_DOUBLE_EQ(rule.log_odds()(2, 4), 0.7 * before);
  scene.has_earlier = false;
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U);
  EXPECT_EQ(rule.log_odds()(2, 4), 0);
}

/// Beliefs after one more frame, cell by cell.
void region_reading(const PairScene& scene, cv::Mat1d& beliefs) {
  const cv::Mat1b now = scene.frame.image, then = scene.earlier.frame.image;
  for (int row = 0; row < beliefs.rows; ++row) {
    for (int column = 0; column < beliefs.cols; ++column) {
      double plain = 0, compensated = 0, samples = 0;
      for (int y = row * 20; y < std::min(120, (row + 1) * 20); y += 4) {
        for (int x = column * 20; x < std::min(160, (column + 1) * 20); x += 4) {
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
      if (samples >= 5) {
        const double d = std::min(plain, compensated) / samples;
        const double below = std::max(0.0, 25 - d) / 12;
        const double above = std::max(0.0, d - 4) / 6;
        const double likelihoods =
            std::exp(-below * below / 2) / 12 / (std::exp(-above * above / 2) / 6);
        evidence = std::log(likelihoods);
      }
      beliefs(row, column) = std::max(-3.0, std::min(3.0, 0.7 * beliefs(row, column) + evidence));
    }
  }
}

TEST(RegionBayes, EqualsTheReadingOnRandomFrames) {
  peers::RegionBayes rule;
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
    region_reading(scene, beliefs);
    ASSERT_LT(cv::norm(rule.log_odds(), beliefs, cv::NORM_INF), 1e-3) << "seed " << seed;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::Point pixel = nearest_pixel(scene.features[i]);
      const bool is_inside = cv::Rect(0, 0, 160, 120).contains(pixel);
      const bool expected = is_inside && rule.log_odds()(pixel.y / 20, pixel.x / 20) > 0;
      ASSERT_EQ(labels.is_removed(i), expected) << "seed " << seed;
      ++(expected ? removals : kept);
    }
  }
  EXPECT_GT(removals, 200U);
  EXPECT_GT(kept, 200U);
}

// --- TemplateStillness ---------------------------------------------------------------------------

const cv::Rect box(60, 40, 40, 40);

/// Background whose image moves 4 px to the right each frame, and a person in a box who moves
/// `person_px` besides. The features: 36 on the background, tracked, and three on the person, the
/// last of them beside his mask.
PairScene walk(int person_px) {
  PairScene scene;
  const cv::Mat1b picture = texture({200, 120}, 1), person = texture({40, 40}, 2);
  picture(cv::Rect(20, 0, 160, 120)).copyTo(scene.frame.image);
  picture(cv::Rect(24, 0, 160, 120)).copyTo(scene.earlier.frame.image);
  person.copyTo(scene.frame.image(box));
  person.copyTo(scene.earlier.frame.image(box - cv::Point(4 + person_px, 0)));
  for (int k = 0; k < 36; ++k) {
    const cv::Point2f at(10.0F + 25.0F * static_cast<float>(k % 6),
                         k < 18 ? 10.0F + 8.0F * static_cast<float>(k / 6)
                                : 85.0F + 8.0F * static_cast<float>(k / 6 - 3));
    scene.features.push_back(at);
    scene.tracks.push_back({at - cv::Point2f(4, 0), true});
  }
  for (const cv::Point2f at : {cv::Point2f(70, 50), {75, 65}, {98, 78}}) {
    scene.features.push_back(at);
    scene.tracks.push_back({at, false});
  }
  Instance instance = Instance::from_box_mask(cv::Mat(40, 30, CV_8UC1, cv::Scalar(1)),
                                              cv::Rect(box.tl(), cv::Size(30, 40)));
  instance.box = box;
  scene.segmentation.instances.push_back(instance);
  instance.box = box - cv::Point(4 + person_px, 0);
  scene.earlier.segmentation = scene.segmentation;
  scene.earlier.segmentation.instances[0] = instance;
  return scene;
}

const std::string background(36, 'o');

TEST(TemplateStillness, KeepsAPersonWhoLooksStillForThreeFrames) {
  peers::TemplateStillness rule;
  const PairScene scene = walk(0);
  EXPECT_EQ(scene.verdicts(rule), background + "xxx");
  EXPECT_EQ(scene.verdicts(rule), background + "xxx");
  EXPECT_EQ(scene.verdicts(rule), background + "ooo");
  EXPECT_EQ(walk(7).verdicts(rule), background + "xxx") << "moves again";
  EXPECT_EQ(scene.verdicts(rule), background + "xxx") << "counts from the beginning";
}

TEST(TemplateStillness, RemovesAPersonWhoMoves) {
  peers::TemplateStillness rule;
  for (int k = 0; k < 6; ++k) EXPECT_EQ(walk(7).verdicts(rule), background + "xxx");
}

TEST(TemplateStillness, TakesWhatItCannotCompareForMoving) {
  const auto verdicts = [&](auto change) {
    peers::TemplateStillness rule;
    for (int k = 0; k < 2; ++k) walk(0).verdicts(rule);
    PairScene scene = walk(0);
    change(scene);
    return scene.verdicts(rule);
  };
  EXPECT_EQ(verdicts([](PairScene&) {}), background + "ooo");
  const auto other_class = [](PairScene& scene) {
    scene.earlier.segmentation.instances[0].class_id = 5;
  };
  EXPECT_EQ(verdicts(other_class), background + "xxx");
  const auto nobody = [](PairScene& scene) { scene.earlier.segmentation.instances.clear(); };
  EXPECT_EQ(verdicts(nobody), background + "xxx");
  EXPECT_EQ(verdicts([](PairScene& scene) { scene.earlier.frame.image.setTo(90); }),
            background + "xxx");
  EXPECT_EQ(verdicts([](PairScene& scene) { scene.has_earlier = false; }), background + "xxx");
  EXPECT_EQ(verdicts([](PairScene& scene) { scene.segmentation.instances[0].class_id = 5; }),
            background + "ooo");
}

}  // namespace
}  // namespace dynfilter::testing
