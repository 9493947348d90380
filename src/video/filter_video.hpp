// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_VIDEO_FILTER_VIDEO_HPP
#define DYNFILTER_SRC_VIDEO_FILTER_VIDEO_HPP

#include <cstddef>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/filter_health.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "video/video_file.hpp"

namespace dynfilter::detail {

/// Returns a picture with lines of white text below it, each in one row, reduced in size if it is
/// too long. A narrow picture is enlarged by a whole factor to at least 640 pixels first.
cv::Mat with_lines_below(const cv::Mat& picture, const std::vector<std::string>& lines);

/// Films a filter at work: the overlay of each frame, its time, its number of features and the age
/// of its masks, counters since the beginning, and the health of the input in a line.
class FilterVideo {
 public:
  /// Throws what VideoFile throws.
  explicit FilterVideo(const std::filesystem::path& file) : file_(file) {}

  /// Adds a frame as the filter judged it; one without an image is counted and not shown.
  /// O(pixels).
  void add(const FrameView& frame, const Segmentation& segmentation, FeaturesView features,
           const FeatureLabels& labels, const FilterHealthReport& health);

  /// Makes the file appear; see VideoFile. Another thread may call it while one adds frames.
  void finish();

 private:
  std::vector<std::string> lines(const FrameView& frame, const FrameStatistics& statistics,
                                 const FilterHealthReport& health) const;

  std::mutex mutex_;
  VideoFile file_;
  std::size_t frames_ = 0, without_masks_ = 0, starved_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_VIDEO_FILTER_VIDEO_HPP
