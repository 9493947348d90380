// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The local binary pattern of dlib, make_uniform_lbp_image: compares like D-LBP, then maps the 256
// patterns to 59. A file of its own, because dlib's headers disturb others.

#include <cstdint>
#include <functional>
#include <memory>

#include <dlib/array2d.h>
#include <dlib/image_transforms.h>
#include <opencv2/core.hpp>

namespace dynfilter::peers {

/// Returns a function that makes the codes of a copy of the image, CV_16UC1, and returns one of
/// them, so that none is optimised away.
std::function<int()> dlib_lbp(const cv::Mat& image) {
  const auto copy = std::make_shared<dlib::array2d<std::uint16_t>>(image.rows, image.cols);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) (*copy)[y][x] = image.at<std::uint16_t>(y, x);
  }
  const auto codes = std::make_shared<dlib::array2d<unsigned char>>();
  return [copy, codes] {
    dlib::make_uniform_lbp_image(*copy, *codes);
    return int{(*codes)[codes->nr() / 2][codes->nc() / 2]};
  };
}

}  // namespace dynfilter::peers
