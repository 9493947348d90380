// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Depths and D-LBP codes of a frame's features.

#ifndef DYNFILTER_DETAIL_DEPTH_READER_HPP
#define DYNFILTER_DETAIL_DEPTH_READER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>

#include <opencv2/core.hpp>

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/depth_lbp_points.hpp"
#include "dynfilter/detail/depth_readings.hpp"
#include "dynfilter/feature_pixels.hpp"

namespace dynfilter::detail {

/// Refers to all that it is made of.
template <class Depth>
struct DepthReader {
  DepthReader(const DepthImage<Depth>& image_there, const DepthLbp& depth_lbp, const cv::Mat& depth,
              const FeaturePixels& pixels_there)
      : image(image_there),
        codes(depth_lbp.points_of<Depth>(depth)),
        pixels(pixels_there),
        known_depths(image.bits_of({0, std::numeric_limits<double>::max()})) {}

  /// Bits of the depths that have codes, where there are eight neighbours.
  static NumberRange depths_with_code() { return {1, DepthBits<Depth>::first_beyond - 1}; }

  const DepthImage<Depth>& image;
  const DepthLbpPoints<Depth> codes;
  const FeaturePixels& pixels;
  const NumberRange known_depths;  ///< bits of them
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_READER_HPP
