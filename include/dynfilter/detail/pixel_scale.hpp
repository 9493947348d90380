// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Returns the factor from pixels at a width of 640, as in options, to pixels of an image.
inline double pixel_scale(const cv::Size& size) { return size.width / 640.0; }

}  // namespace dynfilter::detail
