// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Depths and D-LBP codes of a frame's features.

#ifndef DYNFILTER_DETAIL_DEPTH_READER_HPP
#define DYNFILTER_DETAIL_DEPTH_READER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_lbp.hpp"
#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/depth_lbp_points.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/feature_sampler.hpp"

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

  /// Reads at the pixels of features, or of candidates, in their order. Only that: while no branch
  /// hangs on what is read, the processor works at many pixels at once, whether they are in its
  /// caches or not.
  template <class Iterator>
  void read(Iterator begin, Iterator end, std::vector<PixelReading>& readings) const {
    const DepthLbpPoints<Depth> points = codes;
    const cv::Point* const pixel_of = pixels.data();
    PixelReading* reading = readings.data();
    for (Iterator i = begin; i != end; ++i) {
      const cv::Point pixel = pixel_of[feature_of(*i)];
      points.read(pixel.x, pixel.y, *reading++);
    }
  }

  const DepthImage<Depth>& image;
  const DepthLbpPoints<Depth> codes;
  const FeaturePixels& pixels;
  const NumberRange known_depths;  ///< bits of them

 private:
  static std::size_t feature_of(std::uint32_t feature) { return feature; }
  static std::size_t feature_of(const SampleCandidate& candidate) { return candidate.feature; }
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_READER_HPP
