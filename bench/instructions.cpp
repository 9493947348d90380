// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Work of each rule for callgrind to count, which gives the same numbers on every machine.
// `bash bench/run.sh instructions` runs it and divides by the number of frames.

#include <cstdio>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/motion/motion_filter.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "lab/scenes/scene_levels.hpp"

namespace dynfilter::benchmarks {
namespace {

constexpr int frames = 10;

struct Input {
  SyntheticFrame scene;
  cv::Mat grey;
  std::vector<cv::KeyPoint> keypoints;
};

using Inputs = std::vector<Input>;

// Callgrind finds the functions by their names.
#define MEASURED __attribute__((noinline))

MEASURED void count_orb(Inputs& inputs) {
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(1000);
  cv::Mat descriptors;
  for (Input& input : inputs) {
    orb->detectAndCompute(input.grey, cv::noArray(), input.keypoints, descriptors);
  }
}

template <class Filter>
std::size_t removed_by(Filter&& filter, const Inputs& inputs) {
  FeatureLabels labels;
  Workspace workspace;
  std::size_t removed = 0;
  for (const Input& input : inputs) {
    filter.apply(input.scene.frame, input.scene.poor_segmentation, input.keypoints, labels,
                 workspace);
    removed += labels.statistics().removed();
  }
  return removed;
}

MEASURED std::size_t count_mask(const Inputs& inputs) {
  return removed_by(Pipeline<MaskCuller>(MaskCuller()), inputs);
}

MEASURED std::size_t count_paper(const Inputs& inputs) {
  DynamicFilterOptions options;
  options.compensator.rule = CompensationRule::paper;
  return removed_by(DynamicFilter(options), inputs);
}

MEASURED std::size_t count_depth(const Inputs& inputs) {
  return removed_by(DynamicFilter(), inputs);
}

MEASURED std::size_t count_motion(const Inputs& inputs, const Camera& camera) {
  return removed_by(MotionFilter(camera), inputs);
}

}  // namespace
}  // namespace dynfilter::benchmarks

int main() {
  using namespace dynfilter::benchmarks;
  cv::setNumThreads(1);
  dynfilter::SyntheticSceneOptions options = dynfilter::scene_level("medium");
  const dynfilter::SyntheticScene scene(options);
  Inputs inputs(frames);
  for (int i = 0; i < frames; ++i) {
    Input& input = inputs[static_cast<std::size_t>(i)];
    input.scene = scene.render(40 + i);
    cv::cvtColor(input.scene.frame.image, input.grey, cv::COLOR_BGR2GRAY);
  }
  count_orb(inputs);
  const std::size_t removed[] = {count_mask(inputs), count_paper(inputs), count_depth(inputs),
                                 count_motion(inputs, scene.camera())};
  std::printf("%d frames, features removed by mask, paper, depth, motion: %zu %zu %zu %zu\n",
              frames, removed[0], removed[1], removed[2], removed[3]);
  return removed[0] > 0 && removed[2] > removed[0] ? 0 : 1;
}
