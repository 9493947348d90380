// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Compares dense D-LBP, with and without AVX2, with the code of each pixel, on depth images of any
// size that begin or end at a guard page.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>

#include "dynfilter/dense_depth_lbp.hpp"
#include "fuzz/report.hpp"
#include "support/byte_source.hpp"
#include "support/guarded_image.hpp"

namespace dynfilter::testing {
namespace {

/// Numbers of any bits, or few that are often equal.
template <class Depth>
void fill(ByteSource& source, cv::Mat depth) {
  std::mt19937 random(source.word());
  const bool is_any = source.chance(50);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const auto bits = static_cast<std::uint32_t>(random());
      Depth value;
      std::memcpy(&value, &bits, sizeof(value));
      depth.at<Depth>(y, x) = is_any ? value : static_cast<Depth>(bits % 3);
    }
  }
  // The bytes that are left stand at the end, where a kernel may read too far.
  for (int x = std::max(0, depth.cols - 8); x < depth.cols; ++x) {
    const std::uint32_t bits = source.word();
    std::memcpy(depth.ptr<Depth>(depth.rows - 1) + x, &bits, sizeof(Depth));
  }
}

template <class Depth>
std::string compare(ByteSource& source, const cv::Size& size) {
  const Guard guard = source.chance(70) ? Guard::behind : Guard::before;
  const GuardedImage memory(size, cv::DataType<Depth>::type, guard);
  fill<Depth>(source, memory.image());
  const cv::Point corner(source.between(0, size.width - 1), source.between(0, size.height - 1));
  const bool is_whole = source.chance(50);
  const cv::Rect region =
      is_whole ? cv::Rect({}, size)
               : cv::Rect(corner, cv::Size(size.width, size.height)) & cv::Rect({}, size);
  for (const bool avx2 : {false, true}) {
    if (avx2 && !detail::has_avx2()) continue;
    const GuardedImage codes(size, CV_8UC1, guard);
    cv::Mat written = codes.image();
    cv::Mat expected = written.clone();
    detail::dense_depth_lbp<Depth>(memory.image(), region, written, avx2);
    for (int y = region.y; y < region.br().y; ++y) {
      for (int x = region.x; x < region.br().x; ++x) {
        expected.at<std::uint8_t>(y, x) = DepthLbp().code(memory.image(), {x, y}).value_or(0);
      }
    }
    if (cv::norm(written, expected, cv::NORM_INF) == 0) continue;
    return "the codes " + std::string(avx2 ? "by AVX2" : "without AVX2") + " differ, of " +
           detail::size_name(size);
  }
  return {};
}

}  // namespace
}  // namespace dynfilter::testing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dynfilter::testing;
  ByteSource source(data, size);
  const bool is_large = source.byte() == 255 && source.may_be_costly(64);
  const bool is_usual = !is_large && !source.may_be_costly(16);
  const int width = is_large   ? source.between(1, 4096)
                    : is_usual ? source.between(1, 150)
                               : source.between(1, 300);
  const int height = is_large   ? source.between(1, 48)
                     : is_usual ? source.between(1, 5)
                                : source.between(1, 30);
  const cv::Size image(width, height);
  return report(source.chance(50) ? compare<std::uint16_t>(source, image)
                                  : compare<float>(source, image));
}
