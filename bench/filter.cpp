// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The whole filter on a frame of 640x480 with 1000 features and three persons, by each rule, and
// beside it the extraction of these features, which is what a tracker pays in any case.

#include <vector>

#include <benchmark/benchmark.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include <dynfilter/datasets/scene_levels.hpp>
#include <dynfilter/dynfilter.hpp>

namespace {

struct Input {
  dynfilter::SyntheticFrame frame;
  cv::Mat grey;
  std::vector<cv::KeyPoint> keypoints;
};

const Input& input() {
  static const Input made = [] {
    dynfilter::SyntheticSceneOptions options = dynfilter::scene_level("medium", 1);
    options.persons = 3;
    Input input;
    input.frame = dynfilter::SyntheticScene(options).render(40);
    cv::cvtColor(input.frame.frame.image, input.grey, cv::COLOR_BGR2GRAY);
    cv::ORB::create(1000)->detect(input.grey, input.keypoints);
    return input;
  }();
  return made;
}

void filter_by(benchmark::State& state, dynfilter::CompensationRule rule) {
  dynfilter::DynamicFilterOptions options;
  options.compensator.rule = rule;
  const dynfilter::DynamicFilter filter(options);
  const dynfilter::SyntheticFrame& frame = input().frame;
  dynfilter::FeatureLabels labels;
  dynfilter::Workspace workspace;
  for (auto _ : state) {
    filter.apply(frame.frame, frame.poor_segmentation, input().keypoints, labels, workspace);
    benchmark::DoNotOptimize(labels);
  }
  state.counters["features"] = static_cast<double>(input().keypoints.size());
  state.counters["instances"] = static_cast<double>(frame.poor_segmentation.instances.size());
  state.counters["removed"] = static_cast<double>(labels.statistics().removed());
}
BENCHMARK_CAPTURE(filter_by, object_depth, dynfilter::CompensationRule::object_depth)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(filter_by, paper, dynfilter::CompensationRule::paper)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(filter_by, masks_alone, dynfilter::CompensationRule::none)
    ->Unit(benchmark::kMicrosecond);

void orb_extraction(benchmark::State& state) {
  cv::setNumThreads(1);
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(1000);
  for (auto _ : state) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb->detectAndCompute(input().grey, cv::noArray(), keypoints, descriptors);
    benchmark::DoNotOptimize(descriptors);
  }
}
BENCHMARK(orb_extraction)->Unit(benchmark::kMicrosecond);

}  // namespace
