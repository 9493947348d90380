// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// D-LBP, dense and at points, beside the naive loop and beside memcpy of the depth image, which
// nothing that reads it can beat by much. Each benchmark compares its result with the naive one
// before it is timed. Threads split the rows of one image (dense) or the points.

#include "dynfilter/depth_lbp.hpp"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>

#include "peers/naive_depth_lbp.hpp"

namespace dynfilter {
namespace {

/// A slope with steps, quantisation and holes, as a depth camera gives it.
template <class Depth>
cv::Mat depth_image(const cv::Size& size) {
  constexpr int type = std::is_same_v<Depth, float> ? CV_32FC1 : CV_16UC1;
  cv::Mat depth(size, type);
  std::uint32_t noise = 1;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      noise = noise * 1664525U + 1013904223U;
      const bool is_hole = noise >> 24U < 40;
      const int value =
          6000 + (x / 40 % 5) * 2500 + (y / 3) * 7 + static_cast<int>(noise >> 30U) * 15;
      depth.at<Depth>(y, x) = is_hole ? Depth{0} : static_cast<Depth>(value);
    }
  }
  return depth;
}

cv::Size size_of(const benchmark::State& state) {
  return {static_cast<int>(state.range(0)), static_cast<int>(state.range(1))};
}

/// The rows, or points, of one of the threads that share the work.
struct Share {
  int first;
  int count;
  Share(int total, const benchmark::State& state)
      : first(total * state.thread_index() / state.threads()),
        count(total * (state.thread_index() + 1) / state.threads() - first) {}
};

void report_pixels(benchmark::State& state, const cv::Size& size) {
  state.counters["pixels/s"] =
      benchmark::Counter(static_cast<double>(size.area()) / state.threads(),
                         benchmark::Counter::kIsIterationInvariantRate);
}

template <class Depth>
void dense(benchmark::State& state) {
  // Shared by the threads; made once for each size.
  static cv::Mat depth, codes;
  const cv::Size size = size_of(state);
  if (state.thread_index() == 0) {
    depth = depth_image<Depth>(size);
    codes = cv::Mat::zeros(size, CV_8UC1);
    cv::Mat expected = cv::Mat::zeros(size, CV_8UC1);
    peers::naive_dense<Depth>(depth, expected);
    if (cv::norm(DepthLbp().dense(depth), expected, cv::NORM_INF) != 0) {
      state.SkipWithError("differs from the naive codes");
    }
  }
  const Share rows(size.height, state);
  const cv::Rect region(0, rows.first, size.width, rows.count);
  const DepthLbp lbp;
  for (auto _ : state) {
    lbp.dense(depth, region, codes);
    benchmark::ClobberMemory();
  }
  report_pixels(state, size);
}

template <class Depth>
void dense_naive(benchmark::State& state) {
  const cv::Mat depth = depth_image<Depth>(size_of(state));
  cv::Mat codes = cv::Mat::zeros(depth.size(), CV_8UC1);
  for (auto _ : state) {
    peers::naive_dense<Depth>(depth, codes);
    benchmark::DoNotOptimize(codes.data);
    benchmark::ClobberMemory();
  }
  report_pixels(state, depth.size());
}

template <class Depth>
void dense_memcpy(benchmark::State& state) {
  const cv::Mat depth = depth_image<Depth>(size_of(state));
  cv::Mat copy = depth.clone();
  for (auto _ : state) {
    std::memcpy(copy.data, depth.data, depth.total() * depth.elemSize());
    benchmark::DoNotOptimize(copy.data);
    benchmark::ClobberMemory();
  }
  report_pixels(state, depth.size());
}

std::vector<cv::Point2f> points_in(const cv::Size& size, int count) {
  std::vector<cv::Point2f> points;
  std::uint32_t noise = 7;
  for (int i = 0; i < count; ++i) {
    noise = noise * 1664525U + 1013904223U;
    const auto x = static_cast<float>(1 + noise % static_cast<std::uint32_t>(size.width - 2));
    noise = noise * 1664525U + 1013904223U;
    const auto y = static_cast<float>(1 + noise % static_cast<std::uint32_t>(size.height - 2));
    points.emplace_back(x, y);
  }
  return points;
}

template <class Depth>
void sparse(benchmark::State& state) {
  const cv::Mat depth = depth_image<Depth>({640, 480});
  const auto points = points_in(depth.size(), static_cast<int>(state.range(0)));
  std::vector<std::optional<std::uint8_t>> codes;
  const DepthLbp lbp;
  lbp.codes(depth, points, codes);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point pixel(points[i]);
    if (codes[i].value_or(0) != peers::naive_code<Depth>(depth, pixel.x, pixel.y)) {
      state.SkipWithError("differs from the naive codes");
    }
  }
  const Share share(static_cast<int>(points.size()), state);
  const FeaturesView mine(points.data() + share.first, static_cast<std::size_t>(share.count));
  for (auto _ : state) {
    lbp.codes(depth, mine, codes);
    benchmark::DoNotOptimize(codes.data());
    benchmark::ClobberMemory();
  }
}

template <class Depth>
void sparse_naive(benchmark::State& state) {
  const cv::Mat depth = depth_image<Depth>({640, 480});
  const auto points = points_in(depth.size(), static_cast<int>(state.range(0)));
  std::vector<std::uint8_t> codes(points.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const cv::Point pixel(points[i]);
      codes[i] = peers::naive_code<Depth>(depth, pixel.x, pixel.y);
    }
    benchmark::DoNotOptimize(codes.data());
    benchmark::ClobberMemory();
  }
}

void image_sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({640, 480})->Args({1280, 720})->Args({1920, 1080})->Unit(benchmark::kMicrosecond);
}

void with_threads(benchmark::internal::Benchmark* benchmark) {
  image_sizes(benchmark);
  benchmark->Threads(1)->Threads(2)->UseRealTime();
}

void point_counts(benchmark::internal::Benchmark* benchmark) {
  benchmark->Arg(250)->Arg(1000)->Arg(4000)->Unit(benchmark::kMicrosecond);
}

void points_with_threads(benchmark::internal::Benchmark* benchmark) {
  point_counts(benchmark);
  benchmark->Threads(1)->Threads(2)->UseRealTime();
}

BENCHMARK_TEMPLATE(dense, std::uint16_t)->Apply(with_threads);
BENCHMARK_TEMPLATE(dense, float)->Apply(with_threads);
BENCHMARK_TEMPLATE(dense_naive, std::uint16_t)->Apply(image_sizes);
BENCHMARK_TEMPLATE(dense_naive, float)->Apply(image_sizes);
BENCHMARK_TEMPLATE(dense_memcpy, std::uint16_t)->Apply(image_sizes);
BENCHMARK_TEMPLATE(dense_memcpy, float)->Apply(image_sizes);
BENCHMARK_TEMPLATE(sparse, std::uint16_t)->Apply(points_with_threads);
BENCHMARK_TEMPLATE(sparse, float)->Apply(points_with_threads);
BENCHMARK_TEMPLATE(sparse_naive, std::uint16_t)->Apply(point_counts);
BENCHMARK_TEMPLATE(sparse_naive, float)->Apply(point_counts);

}  // namespace
}  // namespace dynfilter
