// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Measures what motion evidence finds and what it costs, on rendered scenes.
//
//   motion_scores [FIRST_SEED [LAST_SEED [FRAMES [SCENE]]]]    11 11 45, all scenes by default
//
// Prints a row for each scene: the share of the moving features that is removed, from the fourth
// frame on, by the default rule and with motion; the share of the features of still people that is
// kept, from the eighth frame on, with motion; the static features that motion alone removes,
// beyond 15 px and within 3 to 15 px of what moves, as shares of those there; the frames without a
// verdict; and the median time of the stage. Movers are cards of no class, put into the images by
// depth. With "prior" in the name, the host expects a motion of constant velocity and trusts it.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
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

struct Scene {
  std::string name;
  SyntheticSceneOptions options;
  bool has_mover = false;
  Mover mover;
  bool has_masks = true;
  bool persons_move = true;
  bool has_prior = false;
};

std::vector<Scene> scenes(std::uint64_t seed) {
  const auto level = [&](const char* name) { return dynfilter::scene_level(name, seed); };
  const auto with_mover = [&](const char* name, cv::Vec3d speed, double camera_motion) {
    Scene scene{name, level("static"), true, {}, true, true};
    scene.mover.speed_m_s = speed;
    scene.options.camera_motion = camera_motion;
    return scene;
  };
  const auto sitting = [&](const char* name, double camera_motion, bool perfect) {
    Scene scene{name, level("medium"), false, {}, true, false};
    scene.options.person_speed_m_s = 0;
    scene.options.limb_swing = 0;
    scene.options.camera_motion = camera_motion;
    scene.options.perfect_masks = perfect;
    return scene;
  };
  const auto without_masks = [&](const char* name, const char* of_level, bool has_prior) {
    return Scene{name, level(of_level), false, {}, false, true, has_prior};
  };
  return {{"static", level("static"), false, {}, true, true},
          sitting("still", 1, true),
          sitting("still_poor_masks", 1, false),
          sitting("still_fast_camera", 1.5, true),
          {"medium", level("medium"), false, {}, true, true},
          {"cross", level("cross"), false, {}, true, true},
          {"late_10hz", level("late_10hz"), false, {}, true, true},
          without_masks("medium_unmasked", "medium", false),
          without_masks("medium_unmasked_prior", "medium", true),
          without_masks("crowd_unmasked_prior", "crowd", true),
          with_mover("pushed_0.3", {0.3, 0, 0}, 1),
          with_mover("pushed_0.15", {0.15, 0, 0}, 1),
          with_mover("pushed_0.08", {0.08, 0, 0}, 1),
          with_mover("radial_0.5", {0, 0, -0.5}, 1),
          with_mover("pushed_still_camera", {0.3, 0, 0}, 0),
          with_mover("pushed_fast_camera", {0.3, 0, 0}, 1.5)};
}

struct Counts {
  double moving = 0, moving_removed = 0, moving_removed_by_default = 0;
  double still = 0, still_kept = 0, still_kept_by_default = 0;
  double far = 0, far_lost = 0, beside = 0, beside_lost = 0;
  int frames = 0, abstained = 0;
  std::vector<double> times_ms;
  std::vector<double> scales_px;
};

/// Returns the processor time of this thread: other programs do not count.
double thread_time_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Returns what a host expects that follows the camera: its motion into the last frame goes on.
dynfilter::PosePrior constant_velocity(const SyntheticScene& scene, int frame) {
  const int last = std::max(frame - 1, 1);
  const dynfilter::CameraPose now = scene.pose(last), then = scene.pose(last - 1);
  dynfilter::PosePrior prior;
  prior.pose = {then.rotation.t() * now.rotation,
                then.rotation.t() * (now.translation - then.translation)};
  prior.is_trusted = true;
  return prior;
}

using Filter = dynfilter::Pipeline<dynfilter::MaskCuller, dynfilter::Compensator>;

void run(const Scene& description, int frames, Counts& counts) {
  const SyntheticScene scene(description.options);
  const dynfilter::CameraParameters camera = scene.camera();
  dynfilter::MotionState state;
  const dynfilter::MotionJudge judge({camera.fx, camera.fy, camera.cx, camera.cy}, state);
  const Filter filter{dynfilter::MaskCuller(), dynfilter::Compensator()};
  const odometry::OrbExtractor extractor(1000);
  dynfilter::Workspace workspace;
  dynfilter::FeatureLabels by_default, labels;
  for (int index = 0; index < frames; ++index) {
    SyntheticFrame rendered = scene.render(index);
    const cv::Size size = rendered.frame.image.size();
    cv::Mat1b moving(size, std::uint8_t{0}), still(size, std::uint8_t{0});
    const cv::Mat1b persons = painted(rendered.true_segmentation, size);
    (description.persons_move ? moving : still) |= persons;
    if (description.has_mover) moving |= add_mover(description.mover, scene, index, rendered);
    cv::Mat1f distance;
    cv::distanceTransform((moving | still) == 0, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);

    cv::Mat grey, descriptors;
    std::vector<cv::KeyPoint> keypoints;
    cv::cvtColor(rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
    extractor.extract(grey, keypoints, descriptors);
    std::optional<dynfilter::Segmentation> masks;
    if (description.has_masks) masks = rendered.poor_segmentation;
    filter.apply(rendered.frame, masks, keypoints, by_default, workspace);
    labels = by_default;
    const dynfilter::Segmentation segmentation = masks.value_or(dynfilter::Segmentation());
    if (description.has_prior) state.expect_motion(constant_velocity(scene, index));
    const double start_ms = thread_time_ms();
    judge({rendered.frame, segmentation, keypoints}, labels, workspace);
    const double time_ms = thread_time_ms() - start_ms;
    const bool is_judged = labels.statistics().motion.outcome == dynfilter::MotionOutcome::applied;
    ++counts.frames;
    counts.abstained += is_judged || index == 0 ? 0 : 1;
    counts.times_ms.push_back(time_ms);
    counts.scales_px.push_back(labels.statistics().motion.scale_px);
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const cv::Point pixel = dynfilter::nearest_pixel(keypoints[i].pt);
      const bool removed = labels.is_removed(i), removed_before = by_default.is_removed(i);
      const bool lost = removed && !removed_before;
      if (moving(pixel) != 0 && index >= 3) {
        ++counts.moving;
        counts.moving_removed += removed ? 1 : 0;
        counts.moving_removed_by_default += removed_before ? 1 : 0;
      } else if (still(pixel) != 0 && index >= 7) {
        ++counts.still;
        counts.still_kept += removed ? 0 : 1;
        counts.still_kept_by_default += removed_before ? 0 : 1;
      } else if (distance(pixel) > 15) {
        ++counts.far;
        counts.far_lost += lost ? 1 : 0;
      } else if (distance(pixel) > 3) {
        ++counts.beside;
        counts.beside_lost += lost ? 1 : 0;
      }
    }
  }
}

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : NAN; }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

int main(int count, char** words) {
  cv::setNumThreads(1);  // so that the time of this thread is all
  const int first_seed = argument(count, words, 1, 11), last_seed = argument(count, words, 2, 11);
  const int frames = argument(count, words, 3, 45);
  const std::string only = count > 4 ? words[4] : "";
  std::printf("%-22s %17s %17s %10s %10s %9s %8s %8s\n", "", "moving removed %", "still kept %",
              "far", "beside", "no", "scale", "stage");
  std::printf("%-22s %8s %8s %8s %8s %10s %10s %9s %8s %8s\n", "scene", "default", "motion",
              "default", "motion", "lost %", "lost %", "verdict", "px", "ms");
  for (std::size_t s = 0; s < scenes(1).size(); ++s) {
    Counts counts;
    const std::string name = scenes(1)[s].name;
    if (name.find(only) != 0) continue;
    for (int seed = first_seed; seed <= last_seed; ++seed) {
      run(scenes(static_cast<std::uint64_t>(seed))[s], frames, counts);
    }
    std::printf("%-22s %8.1f %8.1f %8.1f %8.1f %10.2f %10.2f %4d/%4d %8.2f %8.2f\n", name.c_str(),
                percent(counts.moving_removed_by_default, counts.moving),
                percent(counts.moving_removed, counts.moving),
                percent(counts.still_kept_by_default, counts.still),
                percent(counts.still_kept, counts.still), percent(counts.far_lost, counts.far),
                percent(counts.beside_lost, counts.beside), counts.abstained, counts.frames,
                median(counts.scales_px), median(counts.times_ms));
    std::fflush(stdout);
  }
  return 0;
}
