// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_BENCH_PEERS_COMPOSED_DEPTH_LBP_HPP
#define DYNFILTER_BENCH_PEERS_COMPOSED_DEPTH_LBP_HPP

#include <cfloat>
#include <cstddef>

#include <opencv2/core.hpp>

namespace dynfilter::peers {

/// D-LBP composed of OpenCV's vectorised functions: compares the image with itself, shifted for
/// each neighbour. Keeps its matrices from call to call.
class ComposedDepthLbp {
 public:
  /// Codes of the inner pixels of a depth image without negative and NaN depths.
  void dense(const cv::Mat& depth, cv::Mat& codes) {
    static constexpr int clockwise[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {1, 0},
                                            {1, 1},   {0, 1},  {-1, 1}, {-1, 0}};
    const cv::Rect inner(1, 1, depth.cols - 2, depth.rows - 2);
    const cv::Mat centre = depth(inner);
    cv::Mat inner_codes = codes(inner);
    inner_codes.setTo(0);
    for (std::size_t k = 0; k < 8; ++k) {
      const cv::Point shift(clockwise[k][0], clockwise[k][1]);
      cv::compare(depth(inner + shift), centre, farther_, cv::CMP_GT);
      cv::bitwise_and(farther_, cv::Scalar(static_cast<double>(1U << k)), farther_);
      cv::bitwise_or(inner_codes, farther_, inner_codes);
    }
    cv::compare(centre, 0, has_depth_, cv::CMP_GT);
    cv::bitwise_and(inner_codes, has_depth_, inner_codes);
  }

 private:
  cv::Mat farther_, has_depth_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_BENCH_PEERS_COMPOSED_DEPTH_LBP_HPP
