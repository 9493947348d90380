// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_PIXEL_SCALE_HPP
#define DYNFILTER_DETAIL_PIXEL_SCALE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Lengths in pixels were chosen on images 640 pixels wide. This many pixels of the image are one
/// pixel there.
inline double pixel_scale(const cv::Size& size) { return size.width / 640.0; }

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_PIXEL_SCALE_HPP
