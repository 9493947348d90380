// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The local binary pattern of dlib, make_uniform_lbp_image: compares like D-LBP, then maps the 256
// patterns to 59. A file of its own, because dlib's headers disturb others.

#include <cstdint>

#include <dlib/array2d.h>
#include <dlib/image_transforms.h>
#include <dlib/opencv/cv_image.h>
#include <opencv2/core.hpp>

namespace dynfilter::peers {

/// Makes the patterns of a depth image, CV_16UC1. They stay valid until the next call.
void dlib_lbp(const cv::Mat& depth, cv::Mat& patterns) {
  static dlib::array2d<unsigned char> made;
  dlib::make_uniform_lbp_image(dlib::cv_image<std::uint16_t>(depth), made);
  patterns = cv::Mat(depth.size(), CV_8UC1, &made[0][0]);
}

}  // namespace dynfilter::peers
