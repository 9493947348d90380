// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Times D-LBP, dense and at points, beside alternatives and beside memcpy of the depth image, which
// no reader of the image can beat by much. Compares each result with the naive one before it is
// timed.
//
//   dense/<u16|f32>/<width>x<height>/<best|without_avx2>               ours; users get `best`
//   dense/<u16|f32>/<width>x<height>/<memcpy|mat_at|bgr2gray|dlib>
//   sparse/<u16|f32>/1000/<codes|naive>/<warm|cold>                    640x480

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/dense_depth_lbp.hpp"

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "peers/naive_depth_lbp.hpp"

namespace dynfilter {
namespace peers {
std::function<int()> dlib_lbp(const cv::Mat& image);  // dlib_lbp.cpp, if built with dlib
}

namespace {

template <class Depth>
constexpr int mat_type = cv::DataType<Depth>::type;

template <class Depth>
constexpr const char* depth_name = std::is_same_v<Depth, float> ? "f32" : "u16";

/// Depth image like a depth camera's: a slope with steps, quantisation and holes.
template <class Depth>
cv::Mat depth_image(const cv::Size& size) {
  cv::Mat depth(size, mat_type<Depth>);
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

template <class Depth>
cv::Mat expected_codes(const cv::Mat& depth) {
  cv::Mat codes = cv::Mat::zeros(depth.size(), CV_8UC1);
  peers::naive_dense<Depth>(depth, codes);
  return codes;
}

/// Times `make_codes(depth, codes)` if its codes are right.
template <class Depth, class MakeCodes>
void time_dense(benchmark::State& state, const cv::Size& size, const MakeCodes& make_codes) {
  const cv::Mat depth = depth_image<Depth>(size);
  cv::Mat codes = cv::Mat::zeros(size, CV_8UC1);
  make_codes(depth, codes);
  if (cv::norm(codes, expected_codes<Depth>(depth), cv::NORM_INF) != 0) {
    state.SkipWithError("differs from the naive codes");
    return;
  }
  for (auto _ : state) {
    make_codes(depth, codes);
    benchmark::DoNotOptimize(codes.data);
    benchmark::ClobberMemory();
  }
}

template <class Depth>
void copy(benchmark::State& state, const cv::Size& size) {
  const cv::Mat depth = depth_image<Depth>(size);
  cv::Mat to = depth.clone();
  for (auto _ : state) {
    std::memcpy(to.data, depth.data, depth.total() * depth.elemSize());
    benchmark::DoNotOptimize(to.data);
    benchmark::ClobberMemory();
  }
}

void bgr_to_grey(benchmark::State& state, const cv::Size& size) {
  cv::Mat colour(size, CV_8UC3), grey;
  cv::randu(colour, cv::Scalar::all(0), cv::Scalar::all(256));
  cv::setNumThreads(1);
  for (auto _ : state) {
    cv::cvtColor(colour, grey, cv::COLOR_BGR2GRAY);
    benchmark::DoNotOptimize(grey.data);
  }
}

std::vector<cv::Point2f> points_in(const cv::Size& size, std::size_t count) {
  std::vector<cv::Point2f> points;
  std::uint32_t noise = 7;
  const auto below = [&noise](int limit) {
    noise = noise * 1664525U + 1013904223U;
    return static_cast<float>((noise >> 8U) % static_cast<std::uint32_t>(limit));
  };
  while (points.size() < count) {
    const float x = 1 + below(size.width - 2);
    points.emplace_back(x, 1 + below(size.height - 2));
  }
  return points;
}

/// Evicts the image from the caches, as the rest of a SLAM system does between two frames.
void evict(const cv::Mat& image) {
#if defined(__x86_64__) && defined(__GNUC__)
  for (std::size_t i = 0; i < image.total() * image.elemSize(); i += 64) {
    __builtin_ia32_clflush(image.data + i);
  }
  __builtin_ia32_mfence();
#else
  static std::vector<char> other(std::size_t{64} << 20U);
  for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
  benchmark::DoNotOptimize(image.data);
#endif
}

/// Times `make_codes(depth, points, codes)` if its codes are right; the naive code 0 may stand for
/// "no code".
template <class Depth, class Code, class MakeCodes>
void time_sparse(benchmark::State& state, std::size_t count, bool is_cold,
                 const MakeCodes& make_codes) {
  const cv::Mat depth = depth_image<Depth>({640, 480});
  const std::vector<cv::Point2f> points = points_in(depth.size(), count);
  std::vector<Code> codes(count);
  make_codes(depth, points, codes);
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Point pixel(points[i]);
    const std::optional<std::uint8_t> code = codes[i];
    if (code.value_or(0) == peers::naive_code<Depth>(depth, pixel.x, pixel.y)) continue;
    state.SkipWithError("differs from the naive codes");
    return;
  }
  for (auto _ : state) {
    if (is_cold) {
      state.PauseTiming();
      evict(depth);
      state.ResumeTiming();
    }
    make_codes(depth, points, codes);
    benchmark::DoNotOptimize(codes.data());
    benchmark::ClobberMemory();
  }
  state.counters["ns/point"] = benchmark::Counter(
      static_cast<double>(count) * 1e-9,
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

using Points = std::vector<cv::Point2f>;
using OptionalCodes = std::vector<std::optional<std::uint8_t>>;

template <class Depth>
void sparse_codes(benchmark::State& state, std::size_t count, bool is_cold) {
  time_sparse<Depth, std::optional<std::uint8_t>>(
      state, count, is_cold,
      [lbp = DepthLbp()](const cv::Mat& depth, const Points& points, OptionalCodes& codes) {
        lbp.codes(depth, points, codes);
      });
}

template <class Depth>
void sparse_naive(benchmark::State& state, std::size_t count, bool is_cold) {
  time_sparse<Depth, std::uint8_t>(
      state, count, is_cold,
      [](const cv::Mat& depth, const Points& points, std::vector<std::uint8_t>& codes) {
        for (std::size_t i = 0; i < points.size(); ++i) {
          const cv::Point pixel(points[i]);
          codes[i] = peers::naive_code<Depth>(depth, pixel.x, pixel.y);
        }
      });
}

#ifdef DYNFILTER_HAS_DLIB
void dense_by_dlib(benchmark::State& state, const cv::Size& size) {
  const auto make_codes = peers::dlib_lbp(depth_image<std::uint16_t>(size));
  for (auto _ : state) benchmark::DoNotOptimize(make_codes());
}
#endif

template <class Depth>
void register_dense(const cv::Size& size) {
  const std::string prefix = std::string("dense/") + depth_name<Depth> + "/" +
                             std::to_string(size.width) + "x" + std::to_string(size.height) + "/";
  const auto add = [&](const std::string& name, auto function) {
    return benchmark::RegisterBenchmark((prefix + name).c_str(), function)
        ->Unit(benchmark::kMicrosecond);
  };
  add("best", [=](benchmark::State& state) {
    time_dense<Depth>(state, size, [](const cv::Mat& depth, cv::Mat& codes) {
      dense_depth_lbp(depth, cv::Rect({0, 0}, depth.size()), codes);
    });
  });
  add("without_avx2", [=](benchmark::State& state) {
    time_dense<Depth>(state, size, [](const cv::Mat& depth, cv::Mat& codes) {
      detail::dense_depth_lbp<Depth>(depth, cv::Rect({0, 0}, depth.size()), codes, false);
    });
  });
  add("memcpy", [=](benchmark::State& state) { copy<Depth>(state, size); });
  add("mat_at",
      [=](benchmark::State& state) { time_dense<Depth>(state, size, peers::naive_dense<Depth>); });
#ifdef DYNFILTER_HAS_DLIB
  if (std::is_same_v<Depth, std::uint16_t>) {
    add("dlib", [=](benchmark::State& state) { dense_by_dlib(state, size); });
  }
#endif
  add("bgr2gray", [=](benchmark::State& state) { bgr_to_grey(state, size); });
}

template <class Depth>
void register_sparse(std::size_t count) {
  const std::string prefix =
      std::string("sparse/") + depth_name<Depth> + "/" + std::to_string(count) + "/";
  for (const bool is_cold : {false, true}) {
    const auto add = [&](const std::string& name, auto function) {
      benchmark::RegisterBenchmark(
          (prefix + name + (is_cold ? "/cold" : "/warm")).c_str(),
          [=](benchmark::State& state) { function(state, count, is_cold); })
          ->Unit(benchmark::kMicrosecond);
    };
    add("codes", sparse_codes<Depth>);
    add("naive", sparse_naive<Depth>);
  }
}

}  // namespace
}  // namespace dynfilter

int main(int argc, char** argv) {
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(3840, 2160)}) {
    dynfilter::register_dense<std::uint16_t>(size);
    dynfilter::register_dense<float>(size);
  }
  dynfilter::register_sparse<std::uint16_t>(1000);
  dynfilter::register_sparse<float>(1000);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
