// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_MOTION_PATCH_HPP
#define DYNFILTER_SRC_MOTION_PATCH_HPP

#include <cstddef>
#include <cstdint>
#include <optional>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Square patch between the pixels of an image, interpolated linearly.
class Patch {
 public:
  /// Returns nothing for a patch that reaches out of the image, also by the row and column beyond
  /// it that are interpolated, and for a reach below 0.
  static std::optional<Patch> at(const cv::Mat1b& image, cv::Point2f centre, int reach) {
    const float left = centre.x - static_cast<float>(reach);
    const float top = centre.y - static_cast<float>(reach);
    const float side = 2 * static_cast<float>(reach) + 1;
    if (reach < 0) return {};
    if (!(left >= 0 && top >= 0 && left + side < static_cast<float>(image.cols) &&
          top + side < static_cast<float>(image.rows)))
      return {};
    const int x = static_cast<int>(left), y = static_cast<int>(top);
    return Patch(image, {x, y}, left - static_cast<float>(x), top - static_cast<float>(y));
  }

  /// Brightness in a row and column of the patch, from 0.
  float operator()(int row, int column) const {
    const std::uint8_t* upper = first_ + row * step_ + column;
    const std::uint8_t* lower = upper + step_;
    const auto along = [this](const std::uint8_t* p) {
      return static_cast<float>(p[0]) * (1 - x_) + static_cast<float>(p[1]) * x_;
    };
    return along(upper) * (1 - y_) + along(lower) * y_;
  }

 private:
  Patch(const cv::Mat1b& image, cv::Point corner, float x, float y)
      : first_(image.ptr(corner.y) + corner.x),
        step_(static_cast<std::ptrdiff_t>(image.step[0])),
        x_(x),
        y_(y) {}

  const std::uint8_t* first_;
  std::ptrdiff_t step_;
  float x_, y_;  // of the first pixel, between two pixels of the image
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_PATCH_HPP
