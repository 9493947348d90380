// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Not part of the umbrella header: its kernels name instruction sets, which take as long to compile
// as everything else together.

#pragma once

#include <algorithm>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/detail/kernels/depth_lbp_dense.hpp"
#include "dynfilter/detail/rectangles.hpp"

namespace dynfilter {

/// Computes the D-LBP codes of all pixels of a region, which may reach beyond the image. `depth` is
/// CV_16UC1 or CV_32FC1.
///
/// `codes` becomes CV_8UC1 of the same size, 0 where a pixel has no code. If it has that type and
/// size already, only the region is written, so threads may share it and each compute some rows.
/// Otherwise it is allocated, with 0 outside the region. `codes` must not share data with `depth`.
///
/// OpenCV's threads share a large region; cv::setNumThreads(1) keeps it in the calling thread.
/// Throws std::invalid_argument for a depth image of another type. O(pixels of the region).
inline void dense_depth_lbp(const cv::Mat& depth, const cv::Rect& region, cv::Mat& codes) {
  // With larger bands, 640x480 has work for one thread only; handing out a smaller one takes longer
  // than computing it.
  constexpr double min_band_bytes = 256 * 1024;
  detail::require_depth_of_lbp(depth);
  if (codes.type() != CV_8UC1 || codes.size() != depth.size()) {
    codes = cv::Mat::zeros(depth.size(), CV_8UC1);
  }
  const cv::Rect inside = detail::clip(region, depth.size());
  const auto compute = [&](const cv::Range& rows) {
    const cv::Rect band(inside.x, rows.start, inside.width, rows.size());
    if (depth.type() == CV_16UC1) {
      detail::dense_depth_lbp<std::uint16_t>(depth, band, codes);
    } else {
      detail::dense_depth_lbp<float>(depth, band, codes);
    }
  };
  const double bytes = 1.0 * inside.width * inside.height * CV_ELEM_SIZE(depth.type());
  cv::parallel_for_(cv::Range(inside.y, inside.y + inside.height), compute,
                    std::clamp<double>(bytes / min_band_bytes, 1, cv::getNumThreads()));
}

/// Computes the codes of the whole image.
inline cv::Mat dense_depth_lbp(const cv::Mat& depth) {
  cv::Mat codes;
  dense_depth_lbp(depth, cv::Rect(0, 0, depth.cols, depth.rows), codes);
  return codes;
}

}  // namespace dynfilter
