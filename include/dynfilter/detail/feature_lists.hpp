// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Lists of features by where they lie.

#ifndef DYNFILTER_DETAIL_FEATURE_LISTS_HPP
#define DYNFILTER_DETAIL_FEATURE_LISTS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/feature_list.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

/// The features that are not removed and lie on a mask whose first pixel is at `origin`: as
/// Instance::covers has it.
inline FeatureList kept_on_mask(const FeaturePixels& pixels, const FeatureLabels& labels,
                                const cv::Mat& mask, cv::Point origin,
                                std::vector<std::uint32_t>& memory) {
  FeatureList list = pixels.inside({origin, mask.size()}, labels.removed_bits(), memory);
  const std::uint8_t* const data = mask.data;
  const auto row_bytes = static_cast<std::int64_t>(mask.step[0]);
  const std::int64_t before = origin.y * row_bytes + origin.x;
  const cv::Point* const pixel_of = pixels.data();
  list.leave_blocks([=](const std::uint32_t* features, std::size_t count) {
    std::uint8_t on_mask[block_size];
    for (std::size_t k = 0; k < count; ++k) {
      const cv::Point pixel = pixel_of[features[k]];
      on_mask[k] = data[pixel.y * row_bytes + pixel.x - before];
    }
    return bits_of_bytes(on_mask);
  });
  return list;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_FEATURE_LISTS_HPP
