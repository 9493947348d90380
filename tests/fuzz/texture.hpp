// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_FUZZ_TEXTURE_HPP
#define DYNFILTER_TESTS_FUZZ_TEXTURE_HPP

#include <opencv2/imgproc.hpp>

namespace dynfilter::testing {

/// Returns a smooth texture in which points can be tracked, CV_8UC1; always the same one.
inline cv::Mat smooth_noise(const cv::Size& size) {
  cv::Mat1b noise(size);
  cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, cv::Size(), 1.2);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  return noise;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_FUZZ_TEXTURE_HPP
