// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_SCENE_IMAGES_HPP
#define DYNFILTER_TESTS_SUPPORT_SCENE_IMAGES_HPP

#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/segmentation.hpp"

namespace dynfilter::testing {

/// Masks of a segmentation drawn on one image: 255 on any instance.
inline cv::Mat1b painted(const Segmentation& segmentation) {
  cv::Mat1b image(segmentation.image_size, std::uint8_t{0});
  for (const Instance& instance : segmentation.instances) {
    if (instance.mask.empty()) continue;
    image(cv::Rect(instance.mask_origin, instance.mask.size())).setTo(255, instance.mask);
  }
  return image;
}

inline bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

/// 64-bit FNV-1a hash of the pixels; pass the hash of one image to continue with the next.
inline std::uint64_t pixel_hash(const cv::Mat& image,
                                std::uint64_t hash = 14695981039346656037ULL) {
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* row = image.ptr(y);
    for (std::size_t i = 0; i < static_cast<std::size_t>(image.cols) * image.elemSize(); ++i) {
      hash = (hash ^ row[i]) * 1099511628211ULL;
    }
  }
  return hash;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_SCENE_IMAGES_HPP
