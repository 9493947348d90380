// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Times the whole filter by each rule, beside the limits of the machine. filter_peers.cpp has the
// alternatives, in the same program. bench/report.py reads these names:
//
//   filter/<rule>/<size>/<features>/<instances>   labels only
//   filter_keep/<rule>/...                        labels, and keep_static of keypoints, descriptors
//   limit/memcpy/...                              keypoints and descriptors, copied once
//   limit/restore/...                             the restoring part of filter_keep
//
// keep_static changes its columns, so filter_keep restores them first. Subtract that time, which
// limit/restore measures.

#include <benchmark/benchmark.h>

#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "filter_check.hpp"
#include "filter_input.hpp"
#include "filter_peers.hpp"
#include "support/failing_allocations.hpp"

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

/// Input of a case, made on first use.
const FilterInputData& input_of(const Case& which) {
  static std::map<std::string, std::unique_ptr<FilterInputData>> made;
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
    const std::string complaint = check_labels(input, options, labels);
    if (!complaint.empty()) state.SkipWithError(complaint.c_str());
    return complaint.empty();
  }

  void report(benchmark::State& state) const {
    state.counters["masked"] = static_cast<double>(labels.statistics().masked);
    state.counters["compensated"] = static_cast<double>(labels.statistics().compensated);
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
      : state_(state), before_(testing::allocations_so_far()) {}
  ~AllocationsPerFrame() {
    if (state_.iterations() == 0) return;
    const auto count = static_cast<double>(testing::allocations_so_far() - before_);
    state_.counters["allocations"] = count / static_cast<double>(state_.iterations());
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

template <class Function, class... Arguments>
benchmark::internal::Benchmark* add(const std::string& name, Function function,
                                    const Arguments&... arguments) {
  return benchmark::RegisterBenchmark(
             name.c_str(), [=](benchmark::State& state) { function(state, arguments...); })
      ->Unit(benchmark::kMicrosecond);
}

std::vector<Case> cases() {
  const cv::Size vga(640, 480);
  std::vector<Case> cases = {{{1920, 1080}, 1000, 3}, {{3840, 2160}, 1000, 3}};
  for (const int features : {250, 1000, 4000, 16384}) cases.push_back({vga, features, 3});
  for (const int instances : {0, 1, 10, 100}) cases.push_back({vga, 1000, instances});
  cases.push_back({vga, 16384, 100});
  return cases;
}

void register_all() {
  for (const Case& which : cases()) {
    for (const Rule& rule : {paper, depth, mask}) {
      add(std::string("filter/") + rule.name + "/" + which.name(), label, rule, which);
    }
  }
  const Case usual = {{640, 480}, 1000, 3};
  add(std::string("filter_keep/") + paper.name + "/" + usual.name(), label_and_keep, paper, usual);
  add("limit/memcpy/" + usual.name(), copy_columns, usual);
  add("limit/restore/" + usual.name(), restore, usual);
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
