// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/segmentation.hpp"

namespace dynfilter::testing {

/// Texture of blotches of a few pixels in all greys.
inline cv::Mat1b texture(const cv::Size& of, std::uint64_t seed) {
  cv::Mat noise(of, CV_32FC1);
  cv::RNG random(seed);
  random.fill(noise, cv::RNG::UNIFORM, 0.0, 1.0);
  cv::GaussianBlur(noise, noise, cv::Size(), 1.5);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  noise.convertTo(noise, CV_8U);
  return noise;
}

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
