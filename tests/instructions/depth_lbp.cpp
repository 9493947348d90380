// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Functions whose instructions count.sh counts: one call of each, by name, on a fixed input.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "counted.hpp"
#include "dynfilter/dense_depth_lbp.hpp"
#include "dynfilter/depth_lbp.hpp"

namespace {

using dynfilter::DepthLbp;

const cv::Size size(640, 480);
constexpr std::size_t points_count = 1000;

std::uint32_t next(std::uint32_t& noise) { return (noise = noise * 1664525U + 1013904223U) >> 8U; }

template <class Depth>
cv::Mat depth_image() {
  cv::Mat depth(size, cv::DataType<Depth>::type);
  std::uint32_t noise = 1;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const std::uint32_t value = next(noise);
      depth.at<Depth>(y, x) = static_cast<Depth>(value % 8 == 0 ? 0 : 1000 + value % 50);
    }
  }
  return depth;
}

std::vector<cv::Point2f> points() {
  std::vector<cv::Point2f> points;
  std::uint32_t noise = 7;
  while (points.size() < points_count) {
    const auto x = static_cast<float>(next(noise) % 640);
    points.emplace_back(x, static_cast<float>(next(noise) % 480));
  }
  return points;
}

}  // namespace

// Not static and not inlined, so that callgrind finds them by name.
extern "C" {

[[gnu::noinline]] void counted_dense(const DepthLbp& lbp, const cv::Mat& depth, cv::Mat& codes) {
  dense_depth_lbp(depth, cv::Rect({0, 0}, depth.size()), codes, lbp.options());
}

[[gnu::noinline]] void counted_sparse(const DepthLbp& lbp, const cv::Mat& depth,
                                      const std::vector<cv::Point2f>& at,
                                      std::vector<std::optional<std::uint8_t>>& codes) {
  lbp.codes(depth, at, codes);
}
}

int main(int argc, char** argv) {
  constexpr std::size_t pixels = 640 * 480;
  const std::string depth_type =
      dynfilter::testing::argument_or_exit(argc, argv,
                                           {{"u16", "counted_dense", pixels, 320},
                                            {"f32", "counted_dense", pixels, 540},
                                            {"u16", "counted_sparse", points_count, 16900},
                                            {"f32", "counted_sparse", points_count, 29000}});
  const cv::Mat depth = depth_type == "f32" ? depth_image<float>() : depth_image<std::uint16_t>();
  cv::Mat codes = cv::Mat::zeros(size, CV_8UC1);
  std::vector<std::optional<std::uint8_t>> sparse(points_count);
  counted_dense(DepthLbp(), depth, codes);
  counted_sparse(DepthLbp(), depth, points(), sparse);
}
