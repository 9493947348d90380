// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_MASK_DISTANCE_HPP
#define DYNFILTER_DETAIL_MASK_DISTANCE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include <opencv2/core.hpp>

#include "dynfilter/instance.hpp"

namespace dynfilter::detail {

/// Half the length of the row of a disc that lies `offset` rows from its centre: the greatest dx
/// with dx^2 + offset^2 <= radius^2. `offset` must not be larger than the radius.
inline std::int64_t chord_half_length(double radius, double offset) {
  const double square = radius * radius - offset * offset;
  auto half = static_cast<std::int64_t>(std::sqrt(square));
  while (static_cast<double>(half * half) > square) --half;  // the root may have been rounded up
  return half;
}

/// What greater radii are taken for: beyond any image, and its square is exact.
constexpr double most_mask_radius = 67108864.0;

/// Whether the mask has a pixel in a figure round `pixel` whose rows, up to `reach` above and
/// below, end half_length(offset) to either side of it.
template <class HalfLength>
bool mask_meets(const Instance& instance, cv::Point pixel, std::int64_t reach,
                const HalfLength& half_length) {
  const cv::Mat& mask = instance.mask;
  const std::int64_t x = std::int64_t{pixel.x} - instance.mask_origin.x;
  const std::int64_t y = std::int64_t{pixel.y} - instance.mask_origin.y;
  const std::int64_t first_row = std::max<std::int64_t>(0, y - reach);
  const std::int64_t last_row = std::min<std::int64_t>(mask.rows - 1, y + reach);
  for (std::int64_t row = first_row; row <= last_row; ++row) {
    const std::int64_t half = half_length(row - y);
    const std::int64_t first = std::max<std::int64_t>(0, x - half);
    const std::int64_t last = std::min<std::int64_t>(mask.cols - 1, x + half);
    const std::uint8_t* pixels = mask.ptr<std::uint8_t>(static_cast<int>(row));
    for (std::int64_t column = first; column <= last; ++column) {
      if (pixels[column] != 0) return true;
    }
  }
  return false;
}

/// Whether a pixel of the mask lies within `radius` pixels (Euclidean, between pixel centres) of
/// `pixel`. A radius of 0, negative or NaN asks for the pixel itself. O(radius^2), and never more
/// than the pixels of the mask.
inline bool mask_within(const Instance& instance, cv::Point pixel, double radius) {
  if (!(radius > 0)) return instance.covers(pixel);
  radius = std::min(radius, most_mask_radius);
  return mask_meets(instance, pixel, static_cast<std::int64_t>(radius), [&](std::int64_t offset) {
    return chord_half_length(radius, static_cast<double>(offset));
  });
}

/// The same for many pixels and one radius: the roots are drawn once.
class MaskDisc {
 public:
  explicit MaskDisc(double radius) : radius_(radius) {
    if (!(radius_ > 0) || radius_ >= static_cast<double>(most_rows)) return;
    reach_ = static_cast<std::int64_t>(radius_);
    for (std::int64_t offset = 0; offset <= reach_; ++offset) {
      half_lengths_[static_cast<std::size_t>(offset)] =
          chord_half_length(radius_, static_cast<double>(offset));
    }
  }

  bool meets(const Instance& instance, cv::Point pixel) const {
    if (reach_ < 0) return mask_within(instance, pixel, radius_);
    return mask_meets(instance, pixel, reach_, [&](std::int64_t offset) {
      return half_lengths_[static_cast<std::size_t>(std::abs(offset))];
    });
  }

 private:
  static constexpr std::size_t most_rows = 16;

  double radius_;
  std::int64_t reach_ = -1;  // negative: no row is kept
  std::array<std::int64_t, most_rows> half_lengths_{};
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_MASK_DISTANCE_HPP
