// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_HOST_IMAGE_HPP
#define DYNFILTER_SRC_PLUGIN_HOST_IMAGE_HPP

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {

/// Checks an image of the host's. Throws std::invalid_argument unless it is CV_8UC1, CV_8UC3 or
/// CV_8UC4.
inline void require_host_image(const cv::Mat& image) {
  const int type = image.type();
  const bool is_picture = !image.empty() && image.dims == 2;
  if (is_picture && (type == CV_8UC1 || type == CV_8UC3 || type == CV_8UC4)) return;
  throw_misuse("Plugin::submit",
               concatenate("an image of type ", type_name(image), " and size ", size_name(image)),
               "CV_8UC1, CV_8UC3 or CV_8UC4");
}

/// Converts the image to a type that segmenters take, grey or BGR. Returns it as it is if it has
/// that type.
inline cv::Mat in_bgr(const cv::Mat& image, bool is_rgb) {
  if (image.channels() == 1 || (image.channels() == 3 && !is_rgb)) return image;
  const bool has_alpha = image.channels() == 4;
  cv::Mat bgr;
  if (is_rgb) {
    cv::cvtColor(image, bgr, has_alpha ? cv::COLOR_RGBA2BGR : cv::COLOR_RGB2BGR);
  } else {
    cv::cvtColor(image, bgr, cv::COLOR_BGRA2BGR);
  }
  return bgr;
}

/// Returns an image of in_bgr in grey, in `memory` if it was not grey.
inline cv::Mat in_grey(const cv::Mat& bgr, cv::Mat& memory) {
  if (bgr.channels() == 1) return bgr;
  cv::cvtColor(bgr, memory, cv::COLOR_BGR2GRAY);
  return memory;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_HOST_IMAGE_HPP
