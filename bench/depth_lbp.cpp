// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Times D-LBP beside alternatives, on one thread and on two, in wall time. Each result is compared
// with what is expected before it is timed. Names are <form>/<depth>/<size>/<threads>/<who>;
// report.py makes a row of the table of all that differ only in <who>, and compares with dynfilter.

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/dense_depth_lbp.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "peers/naive_depth_lbp.hpp"

namespace dynfilter {
namespace peers {
void dlib_lbp(const cv::Mat& depth, cv::Mat& patterns);  // dlib_lbp.cpp, if built with dlib
}

namespace {

using OptionalCodes = std::vector<std::optional<std::uint8_t>>;
using PlainCodes = std::vector<std::uint8_t>;  // 0 is "no code", too

template <class Depth>
std::string name_of(const std::string& form, const cv::Size& size, int threads) {
  return detail::concatenate(form, std::is_same_v<Depth, float> ? "/f32/" : "/u16/", size.width,
                             "x", size.height, "/", threads, "/");
}

/// Depth image like a depth camera's: a slope with steps, quantisation and holes.
template <class Depth>
cv::Mat depth_image(const cv::Size& size) {
  cv::Mat depth(size, cv::DataType<Depth>::type);
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

/// 1000 whole pixels that have neighbours.
std::vector<cv::Point2f> points_in(const cv::Size& size) {
  cv::RNG random(7);
  std::vector<cv::Point2f> points(1000);
  for (cv::Point2f& point : points) {
    point = cv::Point(random.uniform(1, size.width - 1), random.uniform(1, size.height - 1));
  }
  return points;
}

/// Evicts the pixels around points from the caches, as the rest of a SLAM system does between two
/// frames.
template <class Depth>
void evict(const cv::Mat& depth, const std::vector<cv::Point2f>& points) {
#if defined(__x86_64__) && defined(__GNUC__)
  for (const cv::Point pixel : points) {
    for (int y = pixel.y - 1; y <= pixel.y + 1; ++y) {
      for (const int x : {pixel.x - 1, pixel.x + 1}) {
        __builtin_ia32_clflush(depth.ptr<Depth>(y, x));
      }
    }
  }
  __builtin_ia32_mfence();
#else
  static std::vector<char> other(std::size_t{64} << 20U);
  for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
  benchmark::ClobberMemory();
#endif
}

/// Times calls of `work`. The counter is what the table shows: the fastest call, which other
/// programs on the machine delayed least.
template <class Work>
void time_calls(
    benchmark::State& state, const Work& work, const std::function<void()>& prepare = [] {}) {
  double fastest_s = 1e9;
  for (auto _ : state) {
    prepare();
    const auto begin = std::chrono::steady_clock::now();
    work();
    benchmark::ClobberMemory();
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    state.SetIterationTime(passed.count());
    fastest_s = std::min(fastest_s, passed.count());
  }
  state.counters["fastest_us"] = 1e6 * fastest_s;
}

void add(const std::string& name, const std::function<void(benchmark::State&)>& run) {
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond)->UseManualTime();
}

/// Input of a size, and the expected output.
struct Images {
  cv::Mat depth, codes, colour, grey;
};

template <class Depth>
const Images& images_of(const cv::Size& size) {
  static std::map<int, Images> made;
  Images& images = made[size.area()];
  if (images.depth.empty()) {
    images.depth = depth_image<Depth>(size);
    images.codes = cv::Mat::zeros(size, CV_8UC1);
    peers::naive_dense<Depth>(images.depth, {0, size.height}, images.codes);
    images.colour.create(size, CV_8UC3);
    cv::randu(images.colour, cv::Scalar::all(0), cv::Scalar::all(256));
    cv::transform(images.colour, images.grey, cv::Matx13f(0.114F, 0.587F, 0.299F));
  }
  return images;
}

/// Calls `work(rows)` for as many bands of rows as there are threads.
template <class Work>
void in_bands(int rows, const Work& work) {
  cv::parallel_for_(cv::Range(0, rows), work, cv::getNumThreads());
}

void copy_depth(const Images& images, cv::Mat& copy) {
  const cv::Mat& depth = images.depth;
  copy.create(depth.size(), depth.type());
  in_bands(depth.rows, [&](const cv::Range& rows) {
    std::memcpy(copy.ptr(rows.start), depth.ptr(rows.start),
                static_cast<std::size_t>(rows.size()) * depth.step[0]);
  });
}

#ifdef DYNFILTER_HAS_DLIB
/// Whether pixels of the same code have the same pattern. dlib ignores that 0 is no depth.
bool are_patterns_of_codes(const Images& images, const cv::Mat& patterns) {
  std::array<int, 256> pattern_of;
  pattern_of.fill(-1);
  for (int y = 1; y < patterns.rows - 1; ++y) {
    for (int x = 1; x < patterns.cols - 1; ++x) {
      if (images.depth.at<std::uint16_t>(y, x) == 0) continue;
      int& pattern = pattern_of[images.codes.at<std::uint8_t>(y, x)];
      if (pattern < 0) pattern = patterns.at<std::uint8_t>(y, x);
      if (pattern != patterns.at<std::uint8_t>(y, x)) return false;
    }
  }
  return true;
}
#endif

/// Returns a check that an output differs nowhere from the expected one by more than `tolerance`.
auto equals(cv::Mat Images::*expected, double tolerance = 0) {
  return [=](const Images& images, const cv::Mat& output) {
    return cv::norm(output, images.*expected, cv::NORM_INF) <= tolerance;
  };
}

/// Registers `work(images, output)`, which is timed if its output is right.
template <class Depth, class Work, class Check>
void add_dense(const cv::Size& size, int threads, const std::string& who, const Work& work,
               const Check& is_right) {
  const auto run = [=](benchmark::State& state) {
    cv::setNumThreads(threads);
    const Images& images = images_of<Depth>(size);
    cv::Mat output = cv::Mat::zeros(size, CV_8UC1);
    work(images, output);
    if (!is_right(images, output)) {
      state.SkipWithError("the output is wrong");
      return;
    }
    time_calls(state, [&] { work(images, output); });
  };
  add(name_of<Depth>("dense", size, threads) + who, run);
}

template <class Depth>
void register_dense(const cv::Size& size, int threads) {
  const auto add = [=](auto... arguments) { add_dense<Depth>(size, threads, arguments...); };
  const auto dense = [](const Images& images, cv::Mat& codes) {
    dense_depth_lbp(images.depth, cv::Rect({0, 0}, images.depth.size()), codes);
  };
  const auto naive = [](const Images& images, cv::Mat& codes) {
    const auto work = [&](auto& rows) { peers::naive_dense<Depth>(images.depth, rows, codes); };
    in_bands(codes.rows, work);
  };
  const auto to_grey = [](const Images& images, cv::Mat& grey) {
    cv::cvtColor(images.colour, grey, cv::COLOR_BGR2GRAY);
  };
  add("dynfilter", dense, equals(&Images::codes));
  add("memcpy", copy_depth, equals(&Images::depth));
  add("naive_loop", naive, equals(&Images::codes));
  add("BGR_to_grey", to_grey, equals(&Images::grey, 1));  // OpenCV rounds twice
#ifdef DYNFILTER_HAS_DLIB
  const auto dlib = [](const Images& images, cv::Mat& patterns) {
    peers::dlib_lbp(images.depth, patterns);
  };
  if (threads == 1 && !std::is_same_v<Depth, float>) add("dlib_LBP", dlib, are_patterns_of_codes);
#endif
}

/// Registers `work(depth, features, codes)` of 1000 features, each thread with its part of them.
template <class Depth, class Codes, class Work>
void add_features(const cv::Size& size, int threads, bool is_cold, const char* who,
                  const Work& work) {
  const auto run = [=](benchmark::State& state) {
    cv::setNumThreads(threads);
    const Images& images = images_of<Depth>(size);
    const std::vector<cv::Point2f> points = points_in(size);
    const std::size_t part = points.size() / static_cast<std::size_t>(threads);
    std::vector<Codes> codes(static_cast<std::size_t>(threads));
    const auto compute = [&] {
      in_bands(threads, [&](const cv::Range& parts) {
        for (int k = parts.start; k < parts.end; ++k) {
          const auto at = static_cast<std::size_t>(k);
          work(images.depth, FeaturesView(&points[at * part], part), codes[at]);
        }
      });
    };
    compute();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::optional<std::uint8_t> code = codes[i / part][i % part];
      if (code.value_or(0) != images.codes.at<std::uint8_t>(cv::Point(points[i]))) {
        state.SkipWithError("a code is wrong");
        return;
      }
    }
    time_calls(state, compute, [&] {
      if (is_cold) evict<Depth>(images.depth, points);
    });
  };
  add(name_of<Depth>(is_cold ? "features_not_in_cache" : "features", size, threads) + who, run);
}

template <class Depth>
void register_features(const cv::Size& size, int threads, bool is_cold) {
  const auto batch = [](const cv::Mat& depth, FeaturesView features, OptionalCodes& codes) {
    DepthLbp().codes(depth, features, codes);
  };
  const auto naive = [](const cv::Mat& depth, FeaturesView features, PlainCodes& codes) {
    codes.resize(features.size());
    for (std::size_t i = 0; i < features.size(); ++i) {
      const cv::Point pixel(features[i]);
      codes[i] = peers::naive_code<Depth>(depth, pixel.x, pixel.y);
    }
  };
  add_features<Depth, OptionalCodes>(size, threads, is_cold, "dynfilter", batch);
  add_features<Depth, PlainCodes>(size, threads, is_cold, "naive_loop", naive);
}

void register_all() {
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(1280, 720), cv::Size(1920, 1080)}) {
    for (const int threads : {1, 2}) {
      register_dense<std::uint16_t>(size, threads);
      register_dense<float>(size, threads);
      for (const bool is_cold : {false, true}) {
        register_features<std::uint16_t>(size, threads, is_cold);
        register_features<float>(size, threads, is_cold);
      }
    }
  }
}

}  // namespace
}  // namespace dynfilter

int main(int argc, char** argv) {
  dynfilter::register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
