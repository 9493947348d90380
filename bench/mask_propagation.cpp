// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Times moving the masks of three persons into a frame of 640x480, beside plain Lucas-Kanade flow
// of 1000 corners of the full image, with OpenCV's defaults.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include <dynfilter/segmenters/mask_propagator.hpp>
#include "lab/scenes/scene_levels.hpp"

namespace {

constexpr std::size_t length = 24;

const std::vector<dynfilter::SyntheticFrame>& frames() {
  static const std::vector<dynfilter::SyntheticFrame> rendered = [] {
    dynfilter::SyntheticSceneOptions options = dynfilter::scene_level("together", 1);
    options.persons = 3;
    const dynfilter::SyntheticScene scene(options);
    std::vector<dynfilter::SyntheticFrame> all;
    for (int i = 0; i < static_cast<int>(length); ++i) all.push_back(scene.render(40 + i));
    return all;
  }();
  return rendered;
}

/// Propagates masks of every `every`th frame, that many frames late; 0 = no masks. One iteration is
/// one frame.
void propagate(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto every = static_cast<std::size_t>(state.range(0));
  dynfilter::MaskPropagator propagator;
  std::size_t i = 0;
  double instances = 0, calls = 0;
  for (auto _ : state) {
    // Plays the images forwards and backwards, so that there is no cut.
    const std::size_t phase = i % (2 * length - 2);
    const auto at = [&](std::size_t place) -> const dynfilter::SyntheticFrame& {
      return frames()[place < length ? place : 2 * length - 2 - place];
    };
    dynfilter::FrameView frame = at(phase).frame;
    frame.id = i;
    frame.timestamp_s = static_cast<double>(i) / 30;
    std::optional<dynfilter::Segmentation> newest;
    if (every > 0 && i >= every) {
      const std::size_t source = i / every * every - every;
      newest = at(source % (2 * length - 2)).true_segmentation;
      newest->frame_id = source;
      newest->timestamp_s = static_cast<double>(source) / 30;
    }
    auto moved = propagator.propagate(frame, newest);  // newer libraries want no constant
    benchmark::DoNotOptimize(moved);
    if (moved) instances += static_cast<double>(moved->instances.size());
    ++calls;
    ++i;
  }
  state.counters["instances"] = instances / calls;
}
BENCHMARK(propagate)->ArgName("every")->Arg(0)->Arg(3)->Arg(6)->Unit(benchmark::kMillisecond);

void lucas_kanade_of_1000_points(benchmark::State& state) {
  cv::setNumThreads(1);
  cv::Mat first, second;
  cv::cvtColor(frames()[0].frame.image, first, cv::COLOR_BGR2GRAY);
  cv::cvtColor(frames()[1].frame.image, second, cv::COLOR_BGR2GRAY);
  std::vector<cv::Point2f> points;
  cv::goodFeaturesToTrack(first, points, 1000, 0.001, 5);
  for (auto _ : state) {
    std::vector<cv::Point2f> moved;
    std::vector<std::uint8_t> is_found;
    std::vector<float> errors;
    cv::calcOpticalFlowPyrLK(first, second, points, moved, is_found, errors);
    benchmark::DoNotOptimize(moved);
  }
  state.counters["points"] = static_cast<double>(points.size());
}
BENCHMARK(lucas_kanade_of_1000_points)->Unit(benchmark::kMillisecond);

}  // namespace
