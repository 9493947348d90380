// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_ON_MASK_HPP
#define DYNFILTER_DETAIL_ON_MASK_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/feature_pixels.hpp"

namespace dynfilter::detail {

/// Those of the wanted features of a block whose pixel is on a mask that lies at `origin`: the same
/// as Instance::covers, for many.
inline std::uint64_t on_mask(const FeaturePixels& pixels, std::size_t block, std::uint64_t wanted,
                             const cv::Mat& mask, cv::Point origin) {
  const std::uint64_t in_rectangle = pixels.inside(block, {origin, mask.size()});
  const std::size_t row_bytes = mask.step[0];
  std::uint64_t on_mask = 0;
  // No branch hangs on the mask's pixels, which nobody can foresee.
  for_each_bit(wanted & in_rectangle, [&](std::size_t j) {
    const cv::Point pixel = pixels[block * block_size + j];
    const auto x = static_cast<std::size_t>(std::int64_t{pixel.x} - origin.x);
    const auto y = static_cast<std::size_t>(std::int64_t{pixel.y} - origin.y);
    on_mask |= std::uint64_t{mask.data[y * row_bytes + x] != 0} << j;
  });
  return on_mask;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_ON_MASK_HPP
