// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_lbp_point.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/features.hpp"

namespace dynfilter {
namespace detail {

inline void require_depth_of_lbp(const cv::Mat& depth) {
  const bool known = depth.type() == CV_16UC1 || depth.type() == CV_32FC1;
  if ((!known && !depth.empty()) || depth.dims > 2) {
    throw_misuse("DepthLbp", concatenate("a depth image of type ", type_name(depth)),
                 "CV_16UC1 or CV_32FC1");
  }
}

}  // namespace detail

/// Local binary pattern of a depth image, D-LBP (paper section 3.2, Figure 2). Bit k of a pixel's
/// code is 1 if neighbour k, clockwise from the top-left one, is farther away than the pixel; equal
/// depth gives 0, and so does a neighbour without depth: 0 is not greater than the pixel's depth.
///
/// A pixel on the border of the image or without depth has no code. Depth is CV_16UC1 or CV_32FC1;
/// 0, negative, NaN and infinite mean "no depth". Codes only compare depths, so the unit does not
/// matter.
class DepthLbp {
 public:
  /// Returns the code of one pixel, or nothing if it has none. Throws std::invalid_argument for a
  /// depth image of another type. O(1).
  std::optional<std::uint8_t> code(const cv::Mat& depth, cv::Point pixel) const {
    detail::require_depth_of_lbp(depth);
    if (depth.type() == CV_32FC1) return detail::depth_lbp_code<float>(depth, pixel);
    return detail::depth_lbp_code<std::uint16_t>(depth, pixel);
  }

  /// Computes the codes of all features, in their order. `codes` is resized, which reuses its
  /// memory. Throws std::invalid_argument for a depth image of another type. O(features).
  void codes(const cv::Mat& depth, FeaturesView features,
             std::vector<std::optional<std::uint8_t>>& codes) const {
    detail::require_depth_of_lbp(depth);
    codes.resize(features.size());
    if (depth.type() == CV_32FC1) {
      detail::depth_lbp_codes<float>(depth, features, codes.data());
    } else {
      detail::depth_lbp_codes<std::uint16_t>(depth, features, codes.data());
    }
  }
};

}  // namespace dynfilter
