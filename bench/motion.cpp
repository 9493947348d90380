// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Times the parts of motion evidence on a rendered frame of the level "medium" with 1000 features,
// and compares the relative pose with OpenCV's PnP RANSAC where a mover that nothing masks has a
// quarter of the features (the counter error_mm).

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/motion/motion_judge.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include "lab/scenes/scene_levels.hpp"

namespace {

using namespace dynfilter;  // the names of every part

constexpr int frames = 8;

struct Shot {
  SyntheticFrame rendered;
  std::vector<cv::KeyPoint> keypoints;
};

const SyntheticScene& scene() {
  static const SyntheticScene medium(scene_level("medium", 11));
  return medium;
}

Camera camera() { return scene().camera(); }

const std::vector<Shot>& shots() {
  static const std::vector<Shot> all = [] {
    std::vector<Shot> result;
    for (int i = 0; i < frames; ++i) {
      Shot shot{scene().render(i), {}};
      cv::Mat grey;
      std::vector<cv::Point2f> corners;
      cv::cvtColor(shot.rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
      cv::goodFeaturesToTrack(grey, corners, 1000, 1e-3, 6);
      cv::KeyPoint::convert(corners, shot.keypoints);
      result.push_back(std::move(shot));
    }
    return result;
  }();
  return all;
}

/// Runs the whole stage over the frames, again and again, and counts the time of all but the first
/// three, tracking included.
void stage(benchmark::State& state) {
  const bool with_masks = state.range(0) != 0;
  const Pipeline<MaskCuller, Compensator> filter{MaskCuller(), Compensator()};
  MotionJudge judge(camera());
  Workspace workspace;
  FeatureLabels labels;
  int i = 0;
  for (auto _ : state) {
    state.PauseTiming();
    if (i == frames) i = 0;
    if (i == 0) judge.reset();
    for (; i < 3; ++i) {
      const Shot& shot = shots()[static_cast<std::size_t>(i)];
      FeatureLabels warm(shot.keypoints.size(), {});
      judge({shot.rendered.frame, {}, shot.keypoints}, warm, workspace);
    }
    const Shot& shot = shots()[static_cast<std::size_t>(i++)];
    const Segmentation masks = with_masks ? shot.rendered.true_segmentation : Segmentation();
    filter.apply(shot.rendered.frame, masks, shot.keypoints, labels, workspace);
    state.ResumeTiming();
    judge({shot.rendered.frame, masks, shot.keypoints}, labels, workspace);
  }
  state.counters["features"] = static_cast<double>(shots()[0].keypoints.size());
}

/// Returns the camera's motion from a frame of a scene to the one before it.
Pose true_motion(const SyntheticScene& scene, int frame) {
  return scene.pose(frame - 1).inverse() * scene.pose(frame);
}

/// Extracts 1000 ORB features, which a tracker pays anyway: what the tracking is measured by.
void orb_extraction(benchmark::State& state) {
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(1000);
  cv::Mat grey, descriptors;
  cv::cvtColor(shots()[3].rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
  std::vector<cv::KeyPoint> keypoints;
  for (auto _ : state) orb->detectAndCompute(grey, cv::noArray(), keypoints, descriptors);
  if (keypoints.size() < 900) state.SkipWithError("too few keypoints");
}

/// Observations of a static room, and of a mover at 1.2 m that shifts by 10 mm.
std::vector<PoseObservation> observations(const Pose& truth) {
  const SyntheticScene room(scene_level("static", 12));
  const cv::Mat1f depth = room.render(60).exact_depth_m;
  cv::RNG random(7);
  std::vector<PoseObservation> result;
  for (int i = 0; i < 600; ++i) {
    const bool moves = i < 150;
    const cv::Point pixel = moves ? cv::Point(random.uniform(200, 330), random.uniform(150, 330))
                                  : cv::Point(random.uniform(0, 640), random.uniform(0, 480));
    const cv::Point3d point = camera().point(pixel, moves ? 1.2 : double{depth(pixel)});
    const cv::Point3d then = truth * point + cv::Point3d(moves ? 0.01 : 0, 0, 0);
    const cv::Point2d noise(random.gaussian(0.1), random.gaussian(0.1));
    result.push_back({point, *camera().project(then) + noise});
  }
  return result;
}

void pose(benchmark::State& state) {
  const Pose truth = true_motion(SyntheticScene(scene_level("static", 12)), 60);
  const std::vector<PoseObservation> seen = observations(truth);
  const RelativePoseEstimator estimator(camera());
  Workspace workspace;
  RelativePoseEstimate estimate;
  for (auto _ : state) estimate = estimator.estimate(seen, {}, {}, workspace);
  state.counters["error_mm"] = 1e3 * cv::norm(estimate.pose.translation - truth.translation);
}

void pnp_ransac(benchmark::State& state) {
  const Pose truth = true_motion(SyntheticScene(scene_level("static", 12)), 60);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const PoseObservation& one : observations(truth)) {
    points.push_back(one.point_now_m);
    pixels.push_back(one.pixel_then);
  }
  const Camera c = camera();
  const cv::Matx33d intrinsics(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  cv::Vec3d rotation, translation;
  for (auto _ : state) {
    cv::solvePnPRansac(points, pixels, intrinsics, cv::noArray(), rotation, translation, false, 200,
                       2.0F, 0.99);
  }
  state.counters["error_mm"] = 1e3 * cv::norm(translation - truth.translation);
}

// Not by BENCHMARK(), whose names can only be chosen since Google Benchmark 1.5.3.
void register_all() {
  const auto add = [](const char* name, auto* function) {
    return benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond);
  };
  add("motion/stage/masks", stage)->Arg(1);
  add("motion/stage/no_masks", stage)->Arg(0);
  add("motion/orb_extraction", orb_extraction);
  add("motion/pose", pose);
  add("motion/pose_pnp_ransac", pnp_ransac);
}

}  // namespace

int main(int count, char** words) {
  cv::setNumThreads(1);
  register_all();
  benchmark::Initialize(&count, words);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
