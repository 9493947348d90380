// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <opencv2/imgproc.hpp>

namespace dynfilter::detail {

/// Returns a grey, BGR or BGRA image in grey: a grey one as it is, another one in `memory`.
inline cv::Mat grey_of(const cv::Mat& image, cv::Mat& memory) {
  if (image.channels() == 1) return image;
  cv::cvtColor(image, memory, image.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  return memory;
}

}  // namespace dynfilter::detail
