// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Times the whole filter by each rule, beside the limits of the machine. filter_peers.cpp has the
// alternatives, in the same program. Scripts read these names:
//
//   filter/<rule>/<size>/<features>/<instances>          labels only, all in the caches
//   filter_keep/<rule>/...                               labels, and keep_static of keypoints and
//   descriptors filter_cold/<rule>/...                               labels, nothing in the caches
//   filter_two_cameras/<rule>/...                        two threads, each with its own filter
//   limit/memcpy/...                                     keypoints and descriptors, copied once
//   limit/restore/...                                    the restoring part of filter_keep
//   limit/touch/...  limit_cold/touch/...                depth and masks at all features
//
// keep_static changes its columns, so filter_keep restores them first. Subtract that time, which
// limit/restore measures. Restoring leaves the columns in the caches, like a tracker that has just
// computed them.

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "filter_check.hpp"
#include "filter_input.hpp"
#include "filter_peers.hpp"
#include "support/allocation_counter.hpp"

namespace dynfilter::benchmarks {
namespace {

struct Case {
  cv::Size image;
  int features;
  int instances;

  std::string name() const {
    return detail::concatenate(image.width, "x", image.height, "/", features, "/", instances);
  }
};

struct Rule {
  const char* name;
  CompensationRule rule;

  DynamicFilterOptions options() const {
    DynamicFilterOptions options;
    options.compensator.rule = rule;
    return options;
  }
};

constexpr Rule paper = {"paper", CompensationRule::paper};
constexpr Rule depth = {"depth", CompensationRule::depth};
constexpr Rule mask = {"mask", CompensationRule::mask};

/// Input of a case, made on first use and shared by the benchmarks' threads.
const FilterInputData& input_of(const Case& which) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<FilterInputData>> made;
  const std::lock_guard<std::mutex> lock(mutex);
  auto& input = made[which.name()];
  if (!input) {
    input = std::make_unique<FilterInputData>(
        make_filter_input(which.image, static_cast<std::size_t>(which.features), which.instances));
  }
  return *input;
}

/// Filter with the data that a tracker keeps between frames.
struct RunningFilter {
  RunningFilter(const Rule& rule, const Case& which)
      : input(input_of(which)), options(rule.options()), filter(options) {}

  void apply() {
    filter.apply(input.frame, input.segmentation, input.keypoints, labels, workspace);
  }

  /// Runs once, which also allocates memory, and stops the benchmark if the labels are wrong.
  bool check(benchmark::State& state) {
    apply();
    static std::mutex mutex;
    static std::map<std::tuple<const void*, CompensationRule>, std::string> complaints;
    const std::lock_guard<std::mutex> lock(mutex);
    const auto key = std::make_tuple(static_cast<const void*>(&input), options.compensator.rule);
    if (complaints.count(key) == 0) complaints[key] = check_labels(input, options, labels);
    if (!complaints[key].empty()) state.SkipWithError(complaints[key].c_str());
    return complaints[key].empty();
  }

  void report(benchmark::State& state) const {
    const auto per_thread = [&](std::size_t count) {
      return benchmark::Counter(static_cast<double>(count), benchmark::Counter::kAvgThreads);
    };
    state.counters["masked"] = per_thread(labels.statistics().masked);
    state.counters["compensated"] = per_thread(labels.statistics().compensated);
  }

  const FilterInputData& input;
  DynamicFilterOptions options;
  DynamicFilter filter;
  FeatureLabels labels;
  Workspace workspace;
};

/// Counts the allocations of the timed code, per frame.
class AllocationsPerFrame {
 public:
  explicit AllocationsPerFrame(benchmark::State& state)
      : state_(state), before_(testing::allocations_of_this_thread_so_far()) {}
  ~AllocationsPerFrame() {
    if (!testing::can_count_allocations || state_.iterations() == 0) return;
    const auto count = static_cast<double>(testing::allocations_of_this_thread_so_far() - before_);
    state_.counters["allocations"] = benchmark::Counter(
        count / static_cast<double>(state_.iterations()), benchmark::Counter::kAvgThreads);
  }

 private:
  benchmark::State& state_;
  std::size_t before_;
};

void label(benchmark::State& state, const Rule& rule, const Case& which) {
  RunningFilter running(rule, which);
  if (!running.check(state)) return;
  {
    const AllocationsPerFrame allocations(state);
    for (auto _ : state) {
      running.apply();
      benchmark::DoNotOptimize(running.labels);
      benchmark::ClobberMemory();
    }
  }
  running.report(state);
}

/// Keypoints and descriptors of a tracker, restored before each frame.
class Columns {
 public:
  explicit Columns(const FilterInputData& input)
      : input_(input), keypoints(input.keypoints), descriptors(input.descriptors.clone()) {}

  void restore() {
    keypoints.assign(input_.keypoints.begin(), input_.keypoints.end());
    descriptors.adjustROI(0, input_.descriptors.rows - descriptors.rows, 0, 0);
    std::memcpy(descriptors.data, input_.descriptors.data, input_.descriptors.total());
  }

 private:
  const FilterInputData& input_;

 public:
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
};

void label_and_keep(benchmark::State& state, const Rule& rule, const Case& which) {
  RunningFilter running(rule, which);
  if (!running.check(state)) return;
  Columns columns(running.input);
  {
    const AllocationsPerFrame allocations(state);
    for (auto _ : state) {
      columns.restore();
      running.apply();
      benchmark::DoNotOptimize(keep_static(running.labels, columns.keypoints, columns.descriptors));
      benchmark::ClobberMemory();
    }
  }
  if (columns.keypoints.size() != running.labels.statistics().kept()) {
    state.SkipWithError("keep_static kept a wrong number of features");
  }
  running.report(state);
}

void restore(benchmark::State& state, const Case& which) {
  const FilterInputData& input = input_of(which);
  Columns columns(input);
  for (auto _ : state) {
    columns.restore();
    benchmark::DoNotOptimize(columns.keypoints.data());
    benchmark::ClobberMemory();
  }
}

void copy_columns(benchmark::State& state, const Case& which) {
  const FilterInputData& input = input_of(which);
  const std::size_t keypoint_bytes = input.keypoints.size() * sizeof(cv::KeyPoint);
  const std::size_t descriptor_bytes = input.descriptors.total();
  std::vector<unsigned char> copy(keypoint_bytes + descriptor_bytes);
  for (auto _ : state) {
    std::memcpy(copy.data(), static_cast<const void*>(input.keypoints.data()), keypoint_bytes);
    std::memcpy(copy.data() + keypoint_bytes, input.descriptors.data, descriptor_bytes);
    benchmark::DoNotOptimize(copy.data());
    benchmark::ClobberMemory();
  }
}

/// Addresses of the bytes that any such filter must read: for each feature one byte of depth and
/// one of each mask there.
std::vector<const std::uint8_t*> bytes_to_touch(const FilterInputData& input) {
  std::vector<const std::uint8_t*> bytes;
  for (const cv::KeyPoint& keypoint : input.keypoints) {
    const cv::Point pixel = nearest_pixel(keypoint.pt);
    bytes.push_back(input.frame.depth.ptr<std::uint8_t>(pixel.y) + 2 * pixel.x);
    for (const Instance& instance : input.segmentation.instances) {
      const cv::Point in_mask = pixel - instance.mask_origin;
      if (!cv::Rect({0, 0}, instance.mask.size()).contains(in_mask)) continue;
      bytes.push_back(instance.mask.ptr<std::uint8_t>(in_mask.y) + in_mask.x);
    }
  }
  return bytes;
}

unsigned touch_all(const std::vector<const std::uint8_t*>& bytes) {
  unsigned sum = 0;
  for (const std::uint8_t* byte : bytes) sum += *byte;
  return sum;
}

void touch(benchmark::State& state, const Case& which) {
  const auto bytes = bytes_to_touch(input_of(which));
  for (auto _ : state) benchmark::DoNotOptimize(touch_all(bytes));
}

/// Times each frame alone, after other data has filled the caches: for frames that come from a
/// camera's buffer.
void time_cold(benchmark::State& state, const std::function<void()>& frame) {
  std::vector<std::uint8_t> other(64U << 20U, 1);
  for (auto _ : state) {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
    benchmark::ClobberMemory();
    const auto begin = std::chrono::steady_clock::now();
    frame();
    benchmark::ClobberMemory();
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
    state.SetIterationTime(time.count());
  }
}

void label_cold(benchmark::State& state, const Rule& rule, const Case& which) {
  RunningFilter running(rule, which);
  if (!running.check(state)) return;
  time_cold(state, [&] { running.apply(); });
  running.report(state);
}

void touch_cold(benchmark::State& state, const Case& which) {
  const auto bytes = bytes_to_touch(input_of(which));
  time_cold(state, [&] { benchmark::DoNotOptimize(touch_all(bytes)); });
}

template <class Function, class... Arguments>
benchmark::internal::Benchmark* add(const std::string& name, Function function,
                                    const Arguments&... arguments) {
  return benchmark::RegisterBenchmark(
             name.c_str(), [=](benchmark::State& state) { function(state, arguments...); })
      ->Unit(benchmark::kMicrosecond);
}

std::vector<Case> cases() {
  const cv::Size vga(640, 480);
  std::vector<Case> cases;
  for (const cv::Size size :
       {vga, cv::Size(1280, 720), cv::Size(1920, 1080), cv::Size(3840, 2160)}) {
    cases.push_back({size, 1000, 3});
  }
  for (const int features : {250, 500, 2000, 4000, 8000, 16384})
    cases.push_back({vga, features, 3});
  for (const int instances : {0, 1, 10, 30, 100}) cases.push_back({vga, 1000, instances});
  cases.push_back({vga, 16384, 100});
  return cases;
}

void register_all() {
  for (const Case& which : cases()) {
    for (const Rule& rule : {paper, depth, mask}) {
      add(std::string("filter/") + rule.name + "/" + which.name(), label, rule, which);
    }
  }
  const Case usual = {{640, 480}, 1000, 3}, large = {{3840, 2160}, 1000, 3};
  for (const Rule& rule : {paper, depth, mask}) {
    add(std::string("filter_keep/") + rule.name + "/" + usual.name(), label_and_keep, rule, usual);
    add(std::string("filter_two_cameras/") + rule.name + "/" + usual.name(), label, rule, usual)
        ->Threads(2)
        ->UseRealTime();
    for (const Case& which : {usual, large}) {
      add(std::string("filter_cold/") + rule.name + "/" + which.name(), label_cold, rule, which)
          ->UseManualTime()
          ->Iterations(50);
    }
  }
  add("limit/memcpy/" + usual.name(), copy_columns, usual);
  add("limit/restore/" + usual.name(), restore, usual);
  for (const Case& which : {usual, large}) {
    add("limit/touch/" + which.name(), touch, which);
    add("limit_cold/touch/" + which.name(), touch_cold, which)->UseManualTime()->Iterations(50);
  }
}

}  // namespace
}  // namespace dynfilter::benchmarks

int main(int argc, char** argv) {
  // All alternatives run on one thread.
  cv::setNumThreads(1);
  dynfilter::benchmarks::register_all();
  dynfilter::benchmarks::register_filter_peers();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
