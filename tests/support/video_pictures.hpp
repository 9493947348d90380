// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_VIDEO_PICTURES_HPP
#define DYNFILTER_TESTS_SUPPORT_VIDEO_PICTURES_HPP

#include <filesystem>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

namespace dynfilter::testing {

/// All pictures of a video; none if it cannot be read.
inline std::vector<cv::Mat> video_pictures(const std::filesystem::path& file) {
  std::vector<cv::Mat> pictures;
  cv::VideoCapture video(file.string());
  for (cv::Mat picture; video.read(picture);) pictures.push_back(picture.clone());
  return pictures;
}

/// Tells whether this OpenCV writes MPEG-4, asked without dynfilter.
inline bool writes_mp4(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "asked.mp4";
  cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 30, {64, 64});
  const bool is_open = writer.isOpened();
  writer.release();
  std::filesystem::remove(file);
  return is_open;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_VIDEO_PICTURES_HPP
