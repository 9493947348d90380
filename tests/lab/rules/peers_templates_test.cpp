// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rule in src/rules that matches boxes with an earlier image, compared with a naive reading of
// its description on random frames, and with cases made by hand.

#include "lab/rules/template_stillness.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/pair_scene.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

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
  peers::StillObjects memory;
  const peers::TemplateStillness rule(memory);
  const PairScene scene = walk(0);
  EXPECT_EQ(scene.verdicts(rule), background + "xxx");
  EXPECT_EQ(scene.verdicts(rule), background + "xxx");
  EXPECT_EQ(scene.verdicts(rule), background + "ooo");
  EXPECT_EQ(walk(7).verdicts(rule), background + "xxx") << "moves again";
  EXPECT_EQ(scene.verdicts(rule), background + "xxx") << "counts from the beginning";
}

TEST(TemplateStillness, RemovesAPersonWhoMoves) {
  peers::StillObjects memory;
  const peers::TemplateStillness rule(memory);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(walk(7).verdicts(rule), background + "xxx");
}

TEST(TemplateStillness, RemovesTheMaskAloneIfAskedTo) {
  peers::StillObjects memory;
  peers::TemplateStillnessOptions options;
  options.in_box = false;
  EXPECT_EQ(walk(7).verdicts(peers::TemplateStillness(memory, options)), background + "xxo");
}

TEST(TemplateStillness, TakesWhatItCannotCompareForMoving) {
  peers::TemplateStillnessOptions options;
  options.still_frames = 1;
  const auto verdicts = [&](const PairScene& scene) {
    peers::StillObjects memory;
    return scene.verdicts(peers::TemplateStillness(memory, options));
  };
  EXPECT_EQ(verdicts(walk(0)), background + "ooo");
  PairScene scene = walk(0);
  scene.earlier.segmentation.instances[0].class_id = 5;
  EXPECT_EQ(verdicts(scene), background + "xxx");
  scene = walk(0);
  scene.earlier.segmentation.instances.clear();
  EXPECT_EQ(verdicts(scene), background + "xxx");
  scene = walk(0);
  scene.earlier.frame.image.setTo(90);
  EXPECT_EQ(verdicts(scene), background + "xxx");
  scene = walk(0);
  scene.has_earlier = false;
  EXPECT_EQ(verdicts(scene), background + "xxx");
  scene = walk(0);
  scene.segmentation.instances[0].class_id = 5;
  EXPECT_EQ(verdicts(scene), background + "ooo") << "no dynamic class";
}

double overlap_reading(const cv::Rect& a, const cv::Rect& b) {
  double both = 0, either = 0;
  for (int y = -200; y < 400; ++y) {
    const int rows_a = y >= a.y && y < a.y + a.height, rows_b = y >= b.y && y < b.y + b.height;
    const int left = std::max(a.x, b.x), right = std::min(a.x + a.width, b.x + b.width);
    const int common = rows_a != 0 && rows_b != 0 ? std::max(0, right - left) : 0;
    both += common;
    either += rows_a * a.width + rows_b * b.width - common;
  }
  return both / either;
}

/// Best correlation coefficient over the places within 2 px, of images that the camera's motion
/// does not change.
double correlation_reading(const PairScene& scene, const cv::Rect& at) {
  const cv::Rect area = at & cv::Rect(0, 0, 160, 120);
  const cv::Mat1b now = scene.frame.image, then = scene.earlier.frame.image;
  double best = -1;
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const cv::Rect moved = area + cv::Point(dx, dy);
      if ((moved & cv::Rect(0, 0, 160, 120)) != moved) continue;
      const double count = area.area(), mean_now = cv::mean(now(moved))[0],
                   mean_then = cv::mean(then(area))[0];
      double product = 0, squares_now = 0, squares_then = 0;
      for (int k = 0; k < static_cast<int>(count); ++k) {
        const cv::Point offset(k % area.width, k / area.width);
        const double a = now(moved.tl() + offset) - mean_now;
        const double b = then(area.tl() + offset) - mean_then;
        product += a * b;
        squares_now += a * a;
        squares_then += b * b;
      }
      best = std::max(best, product / std::sqrt(squares_now * squares_then));
    }
  }
  return best;
}

TEST(TemplateStillness, EqualsTheReadingOnRandomFrames) {
  std::size_t removals = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    peers::StillObjects memory;
    const peers::TemplateStillness rule(memory);
    std::vector<std::pair<cv::Rect, int>> frames_still;  // of the last frame's persons
    for (std::uint64_t k = 0; k < 5; ++k) {
      PairScene scene = arbitrary_pair(seed);
      for (FeatureTrack& track : scene.tracks) track.is_found = false;  // nothing is warped
      const cv::Mat1b picture = texture({160, 120}, seed);
      const double change = 0.35 * static_cast<double>((seed + k) % 4 == 0 ? 2 : seed % 2);
      cv::addWeighted(picture, 1 - change, texture({160, 120}, 100 * seed + k), change, 0,
                      scene.frame.image);
      picture.copyTo(scene.earlier.frame.image);
      scene.earlier.segmentation = scene.segmentation;
      for (Instance& one : scene.earlier.segmentation.instances) one.box.x += 5;
      std::vector<bool> expected(scene.features.size());
      std::vector<std::pair<cv::Rect, int>> seen;
      bool is_clear = true;
      for (const Instance& one : scene.segmentation.instances) {
        if (one.class_id != 0) continue;
        bool was_there = false;
        for (const Instance& other : scene.earlier.segmentation.instances) {
          was_there =
              was_there || (other.class_id == 0 && overlap_reading(other.box, one.box) > 0.3);
        }
        const bool is_visible = !(one.box & cv::Rect(0, 0, 160, 120)).empty();
        const double score = was_there && is_visible ? correlation_reading(scene, one.box) : -1;
        is_clear = is_clear && std::abs(score - 0.85) > 1e-3;
        cv::Scalar mean, deviation;
        if (is_visible) {
          cv::meanStdDev(picture(one.box & cv::Rect(0, 0, 160, 120)), mean, deviation);
        }
        int frames = 0;
        if (score > 0.85 && deviation[0] >= 1) {
          double best = 0.3;
          for (const auto& [before, count] : frames_still) {
            if (overlap_reading(before, one.box) <= best) continue;
            best = overlap_reading(before, one.box);
            frames = count;
          }
          ++frames;
        }
        seen.emplace_back(one.box, frames);
        for (std::size_t i = 0; i < expected.size() && frames < 3; ++i) {
          const cv::Point pixel = nearest_pixel(scene.features[i]);
          const bool is_inside = cv::Rect(0, 0, 160, 120).contains(pixel);
          if (is_inside && one.box_contains(pixel)) expected[i] = true;
        }
      }
      frames_still = seen;
      const std::vector<bool> removed = removed_by(rule, scene);
      if (!is_clear) break;  // the two computations may differ at the threshold
      ASSERT_EQ(removed, expected) << "seed " << seed << ", frame " << k;
      for (const bool is_removed : expected) ++(is_removed ? removals : kept);
    }
  }
  EXPECT_GT(removals, 300U);
  EXPECT_GT(kept, 500U);
}

TEST(TemplateStillness, RemembersObjectsOfTheClassAndPlaceOnly) {
  const auto verdicts = [](const peers::StillObjects::Object& remembered) {
    peers::StillObjects memory;
    memory.list.push_back(remembered);
    return walk(0).verdicts(peers::TemplateStillness(memory));
  };
  EXPECT_EQ(verdicts({0, box, 2}), background + "ooo");
  EXPECT_EQ(verdicts({5, box, 2}), background + "xxx");
  EXPECT_EQ(verdicts({0, box + cv::Point(60, 0), 2}), background + "xxx");
}

TEST(TemplateStillness, RefusesOptionsOutOfRange) {
  peers::StillObjects memory;
  peers::TemplateStillnessOptions options;
  options.still_frames = 0;
  expect_error<std::invalid_argument>([&] { peers::TemplateStillness(memory, options); },
                                      "still_frames must be 1 or more");
}

}  // namespace
}  // namespace dynfilter::testing
