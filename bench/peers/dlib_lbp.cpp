// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dlib_lbp.hpp"

#include <cstdint>

#include <dlib/array2d.h>
#include <dlib/image_transforms.h>

namespace dynfilter::peers {

struct DlibLbp::Matrices {
  dlib::array2d<std::uint16_t> image;
  dlib::array2d<unsigned char> codes;
};

DlibLbp::DlibLbp(const cv::Mat& image) : matrices_(std::make_unique<Matrices>()) {
  matrices_->image.set_size(image.rows, image.cols);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) matrices_->image[y][x] = image.at<std::uint16_t>(y, x);
  }
}

DlibLbp::~DlibLbp() = default;

void DlibLbp::make_codes() { dlib::make_uniform_lbp_image(matrices_->image, matrices_->codes); }

cv::Mat DlibLbp::codes() const {
  const dlib::array2d<unsigned char>& from = matrices_->codes;
  cv::Mat codes(static_cast<int>(from.nr()), static_cast<int>(from.nc()), CV_8UC1);
  for (int y = 0; y < codes.rows; ++y) {
    for (int x = 0; x < codes.cols; ++x) codes.at<std::uint8_t>(y, x) = from[y][x];
  }
  return codes;
}

}  // namespace dynfilter::peers
