// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_VIDEO_VIDEO_FILE_HPP
#define DYNFILTER_SRC_VIDEO_VIDEO_FILE_HPP

#include <cstddef>
#include <filesystem>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Writes a video that appears whole, with finish, or not at all: name.mp4 (MPEG-4, which needs an
/// OpenCV with FFmpeg or GStreamer) or name.avi (Motion JPEG, which OpenCV writes itself).
///
/// Until then it grows in a hidden folder beside it, which the next video of this name removes if
/// the process is killed. A list beside it, `.dynfilter-video.txt`, says which videos were written:
/// another file of its name is not replaced.
class VideoFile {
 public:
  /// Makes the hidden folder, and tries the codec. Throws std::runtime_error that names the file:
  /// for another ending, for a folder that is missing or cannot be written to, for a file in the
  /// way that is no video of an earlier VideoFile, while another one writes it, if this OpenCV
  /// cannot write such videos, and if this build has no videos.
  explicit VideoFile(const std::filesystem::path& file);
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;
  /// Drops a video that is not finished.
  ~VideoFile();

  /// Appends a picture of type CV_8UC3 (BGR), with its time in seconds. The first pictures decide:
  /// later ones are scaled to the size of the first, and the median gap between the first times
  /// gives the constant rate of the video.
  void add(const cv::Mat& picture, double timestamp_s);

  /// Closes the video, reads it back and moves it to its place. Without pictures there is no video.
  /// A second call does nothing. Throws std::runtime_error that names the file if it could not be
  /// written whole.
  void finish();

  const std::filesystem::path& file() const { return file_; }

 private:
  struct Writer;

  std::filesystem::path file_;
  std::unique_ptr<Writer> writer_;  // null after finish
};

/// Returns the frames a second of a video whose pictures have these times: one over the median gap,
/// 1 to 120; 30 for fewer than two times.
double rate_of(const std::vector<double>& times_s);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_VIDEO_VIDEO_FILE_HPP
