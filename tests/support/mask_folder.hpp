// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_MASK_FOLDER_HPP
#define DYNFILTER_TESTS_SUPPORT_MASK_FOLDER_HPP

#include <cstdint>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {

inline const std::string table_header = "frame,instance,class_id,score,x,y,width,height\n";

inline FrameView frame_at(double timestamp_s, cv::Size size = {8, 6}) {
  FrameView frame;
  frame.id = 77;
  frame.timestamp_s = timestamp_s;
  frame.image = cv::Mat(size, CV_8UC3, cv::Scalar::all(0));
  return frame;
}

inline void write_mask(const TemporaryFolder& folder, const std::string& file,
                       const cv::Mat& mask) {
  std::filesystem::create_directories((folder / file).parent_path());
  ASSERT_TRUE(cv::imwrite((folder / file).string(), mask));
}

inline cv::Mat full_mask(const Instance& instance, cv::Size size) {
  cv::Mat full(size, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      full.at<std::uint8_t>(y, x) = instance.covers({x, y}) ? 255 : 0;
    }
  }
  return full;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_MASK_FOLDER_HPP
