// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Measures how soon motion evidence removes what begins to move, on rendered scenes.
//
//   motion_latency [FIRST_SEED [LAST_SEED [SCENE]]]    11 11, all scenes by default
//
// An object begins to move when at least half of its pixels move and fewer did so in the ten frames
// before, or when it appears and moves. The latency is the number of frames from then to the first
// one in which at least 90 % of its features are removed: 0 if that is at once. A start is missed
// if the object is still again before, or not removed within ten frames at the scene's end. Prints
// a row for each scene: the starts, and for the rule depth without and with motion the median and
// the largest latency and the misses. Objects are the persons, who have masks, and a card of no
// class.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/motion/motion_judge.hpp>
#include <opencv2/imgproc.hpp>
#include "lab/odometry/odometry.hpp"
#include "lab/scenes/scene_levels.hpp"

#include "arguments.hpp"
#include "moving_card.hpp"

namespace {

using dynfilter::SyntheticFrame;
using dynfilter::SyntheticScene;
using dynfilter::SyntheticSceneOptions;

constexpr int card_start = 20;  // frames
constexpr int rest_frames = 10;
constexpr int min_features = 5;

struct Scene {
  std::string name;
  SyntheticSceneOptions options;
  Mover mover;
  bool has_mover = false;
};

std::vector<Scene> scenes(std::uint64_t seed) {
  const auto persons = [&](const char* name, double speed_m_s, bool perfect_masks) {
    Scene scene{name, dynfilter::scene_level("stop_and_go", seed), {}};
    scene.options.frames = 135;  // a period is 120
    scene.options.person_speed_m_s = speed_m_s;
    scene.options.perfect_masks = perfect_masks;
    return scene;
  };
  const auto card = [&](const char* name, cv::Vec3d speed_m_s, bool is_there_before) {
    Scene scene{name, dynfilter::scene_level("static", seed), {}, true};
    scene.options.frames = 45;
    scene.mover.speed_m_s = speed_m_s;
    scene.mover.start_index = card_start;
    scene.mover.is_there_before = is_there_before;
    return scene;
  };
  return {persons("person_starts_0.8", 0.8, true),
          persons("person_starts_0.8_poor", 0.8, false),
          persons("person_starts_0.15", 0.15, true),
          card("card_starts_0.3", {0.3, 0, 0}, true),
          card("card_starts_0.15", {0.15, 0, 0}, true),
          card("card_starts_0.08", {0.08, 0, 0}, true),
          card("card_starts_radial_0.5", {0, 0, -0.5}, true),
          card("card_appears_0.3", {0.3, 0, 0}, false),
          card("card_appears_0.15", {0.15, 0, 0}, false),
          card("card_appears_0.08", {0.08, 0, 0}, false),
          card("card_appears_radial_0.5", {0, 0, -0.5}, false)};
}

/// What a frame shows of an object.
struct Sight {
  bool moves = false;
  int features = 0;  ///< on what moves of it
  int removed = 0;
};

/// Follows one object under one rule.
class Latency {
 public:
  void add(const Sight& sight) {
    if (!sight.moves) {
      if (is_waiting_) ++misses;
      is_waiting_ = false;
      ++rested_;
      return;
    }
    if (rested_ >= rest_frames) {
      is_waiting_ = true;
      waited_ = 0;
    }
    rested_ = 0;
    if (!is_waiting_) return;
    if (sight.features >= min_features && 10 * sight.removed >= 9 * sight.features) {
      frames.push_back(waited_);
      is_waiting_ = false;
    }
    ++waited_;
  }

  /// Ends the scene. A start just before is not judged.
  void finish() {
    if (is_waiting_ && waited_ >= rest_frames) ++misses;
  }

  std::vector<int> frames;  ///< one for each start that was answered
  int misses = 0;

 private:
  int rested_ = 0, waited_ = 0;
  bool is_waiting_ = false;
};

/// Results of all objects under one rule.
struct Results {
  std::vector<int> frames;
  int misses = 0;

  void add(Latency latency) {
    latency.finish();
    frames.insert(frames.end(), latency.frames.begin(), latency.frames.end());
    misses += latency.misses;
  }

  /// Formats the median, where a miss is the longest, and the largest latency but the misses.
  std::string text() const {
    std::vector<int> sorted = frames;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t middle = (frames.size() + static_cast<std::size_t>(misses)) / 2;
    const std::string median = middle < sorted.size() ? std::to_string(sorted[middle]) : "-";
    const std::string largest = sorted.empty() ? "-" : std::to_string(sorted.back());
    char cells[64];
    std::snprintf(cells, sizeof cells, "%8s %8s %8d", median.c_str(), largest.c_str(), misses);
    return cells;
  }
};

constexpr int card_key = -1;

/// Returns the pixels of each object, and whether it moves.
std::map<int, std::pair<cv::Mat1b, bool>> objects_of(const Scene& description,
                                                     const SyntheticScene& scene, int index,
                                                     SyntheticFrame& rendered) {
  std::map<int, std::pair<cv::Mat1b, bool>> objects;
  const cv::Size size = rendered.frame.image.size();
  for (const dynfilter::Instance& person : rendered.true_segmentation.instances) {
    dynfilter::Segmentation alone = rendered.true_segmentation;
    alone.instances = {person};
    const cv::Mat1b silhouette = painted(alone, size);
    cv::Mat1b moving;
    cv::bitwise_and(silhouette, rendered.moving_mask, moving);
    const bool moves = 2 * cv::countNonZero(moving) >= cv::countNonZero(silhouette);
    objects[person.track_id.value()] = {moving, moves};
  }
  if (description.has_mover) {
    const cv::Mat1b visible = add_mover(description.mover, scene, index, rendered);
    const int first = card_start + (description.mover.is_there_before ? 1 : 0);
    objects[card_key] = {visible, index >= first};
  }
  return objects;
}

using Filter = dynfilter::Pipeline<dynfilter::MaskCuller, dynfilter::Compensator>;

void run(const Scene& description, Results& by_default, Results& with_motion) {
  const SyntheticScene scene(description.options);
  const dynfilter::CameraParameters camera = scene.camera();
  dynfilter::MotionState state;
  const dynfilter::MotionJudge judge({camera.fx, camera.fy, camera.cx, camera.cy}, state);
  const Filter filter{dynfilter::MaskCuller(), dynfilter::Compensator()};
  const odometry::OrbExtractor extractor(1000);
  dynfilter::Workspace workspace;
  dynfilter::FeatureLabels before, labels;
  std::map<int, Latency> latencies_before, latencies;
  for (int index = 0; index < scene.size(); ++index) {
    SyntheticFrame rendered = scene.render(index);
    const auto objects = objects_of(description, scene, index, rendered);
    cv::Mat grey, descriptors;
    std::vector<cv::KeyPoint> keypoints;
    cv::cvtColor(rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
    extractor.extract(grey, keypoints, descriptors);
    filter.apply(rendered.frame, rendered.poor_segmentation, keypoints, before, workspace);
    labels = before;
    judge({rendered.frame, rendered.poor_segmentation, keypoints}, labels, workspace);
    for (const auto& [key, object] : objects) {
      Sight sight_before{object.second}, sight{object.second};
      for (std::size_t i = 0; i < keypoints.size(); ++i) {
        if (object.first(dynfilter::nearest_pixel(keypoints[i].pt)) == 0) continue;
        ++sight_before.features;
        ++sight.features;
        sight_before.removed += before.is_removed(i) ? 1 : 0;
        sight.removed += labels.is_removed(i) ? 1 : 0;
      }
      latencies_before[key].add(sight_before);
      latencies[key].add(sight);
    }
  }
  for (const auto& [key, latency] : latencies_before) by_default.add(latency);
  for (const auto& [key, latency] : latencies) with_motion.add(latency);
}

}  // namespace

int main(int count, char** words) {
  const int first_seed = argument(count, words, 1, 11), last_seed = argument(count, words, 2, 11);
  const std::string only = count > 3 ? words[3] : "";
  std::printf("%-24s %6s %26s %26s\n", "", "", "rule depth, frames", "with motion, frames");
  std::printf("%-24s %6s %8s %8s %8s %8s %8s %8s\n", "scene", "starts", "median", "largest",
              "missed", "median", "largest", "missed");
  for (std::size_t s = 0; s < scenes(1).size(); ++s) {
    const std::string name = scenes(1)[s].name;
    if (name.find(only) != 0) continue;
    Results by_default, with_motion;
    for (int seed = first_seed; seed <= last_seed; ++seed) {
      run(scenes(static_cast<std::uint64_t>(seed))[s], by_default, with_motion);
    }
    const int starts = static_cast<int>(with_motion.frames.size()) + with_motion.misses;
    std::printf("%-24s %6d %s %s\n", name.c_str(), starts, by_default.text().c_str(),
                with_motion.text().c_str());
    std::fflush(stdout);
  }
  return 0;
}
