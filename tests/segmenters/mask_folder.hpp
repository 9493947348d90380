// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

inline const std::string table_header = "frame,instance,class_id,score,x,y,width,height\n";

inline FrameView frame_at(double timestamp_s, cv::Size size = {8, 6}) {
  FrameView frame;
  frame.id = 77;
  frame.timestamp_s = timestamp_s;
  frame.image = cv::Mat(size, CV_8UC3, cv::Scalar::all(0));
  return frame;
}

inline MaskFolderOptions allowing_missing() {
  MaskFolderOptions options;
  options.allow_missing = true;
  return options;
}

/// Expects that a folder cannot be read.
inline void expect_refused(const std::filesystem::path& folder, const std::string& message,
                           const MaskFolderOptions& options = {}) {
  expect_failure([&] { MaskFolderSegmenter(folder, options); }, message);
}

/// Expects that there are no masks of a time.
inline void expect_no_masks(MaskFolderSegmenter& people, double time_s,
                            const std::string& message) {
  expect_failure([&] { people.segment(frame_at(time_s)); }, message);
}

inline void write_mask(const TemporaryFolder& folder, const std::string& file,
                       const cv::Mat& mask) {
  std::filesystem::create_directories((folder / file).parent_path());
  ASSERT_TRUE(cv::imwrite((folder / file).string(), mask));
}

inline cv::Mat full_mask(const Instance& instance, cv::Size size) {
  cv::Mat1b full(size);
  full.forEach([&](std::uint8_t& value, const int* at) {
    value = instance.covers({at[1], at[0]}) ? 255 : 0;
  });
  return full;
}

}  // namespace dynfilter::testing
