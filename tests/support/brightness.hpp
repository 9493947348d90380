// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_BRIGHTNESS_HPP
#define DYNFILTER_TESTS_SUPPORT_BRIGHTNESS_HPP

#include <cmath>

#include <opencv2/core.hpp>

namespace dynfilter::testing {

/// Oracle: the brightness at a real position.
inline double brightness(const cv::Mat1b& image, double x, double y) {
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const double a = x - left, b = y - top;
  return (1 - b) * ((1 - a) * image(top, left) + a * image(top, left + 1)) +
         b * ((1 - a) * image(top + 1, left) + a * image(top + 1, left + 1));
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_BRIGHTNESS_HPP
