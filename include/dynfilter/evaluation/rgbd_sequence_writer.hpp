// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_RGBD_SEQUENCE_WRITER_HPP
#define DYNFILTER_EVALUATION_RGBD_SEQUENCE_WRITER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <string>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/frame.hpp"

namespace dynfilter {
namespace detail {
class StagedFolder;
}

struct RgbdSequenceWriterOptions {
  /// Whether a sequence that an earlier RgbdSequenceWriter wrote into the folder may be replaced.
  bool overwrite = false;
};

/// Writes frames as a sequence in the layout that RgbdSequence reads: camera.yaml, rgb/, rgb.txt,
/// with depth also depth/, depth.txt and associations.txt, with poses groundtruth.txt. Images are
/// named by their time, 1341846434.710184.png.
///
/// The sequence appears in the folder all at once, with finish(), its lists last. Before it, and
/// where a writer is destroyed without it, fails or is killed, the folder holds what it held. Files
/// are collected in a hidden folder, .dynfilter-sequence-<process id>; .dynfilter-sequence.txt
/// lists what was written, so that a later writer knows what it may replace.
class RgbdSequenceWriter {
 public:
  /// Makes the folder where needed. Throws std::runtime_error that names what is in the way:
  /// camera.yaml, a list, an image in rgb/ or depth/ whose name is a time, and anything that an
  /// earlier writer wrote. With `overwrite` that is only what no earlier writer wrote, or what was
  /// changed since. Throws std::runtime_error also while another writer is at work in the folder,
  /// and std::invalid_argument for a camera that write_camera refuses.
  RgbdSequenceWriter(const std::filesystem::path& folder, const CameraParameters& camera,
                     const RgbdSequenceWriterOptions& options = {});
  RgbdSequenceWriter(RgbdSequenceWriter&&) noexcept;
  RgbdSequenceWriter& operator=(RgbdSequenceWriter&&) noexcept;
  ~RgbdSequenceWriter();

  /// Adds a frame whose pose is not known, all of it or nothing. Its time must be a microsecond
  /// after the last one's at least; the image CV_8UC1 or CV_8UC3; the depth CV_16UC1 or CV_32FC1,
  /// written in the units of the camera's DepthMapFactor (unchanged where metres_per_unit says the
  /// same; else rounded to the nearest unit, and 0 where a 16-bit image cannot hold it), or empty
  /// in every frame. Throws std::invalid_argument for a frame that is not so, for one whose size is
  /// not the camera's, and after finish(), with nothing written; std::runtime_error that names the
  /// file that cannot be written. O(pixels).
  void add(const FrameView& frame);

  /// The same, with where the camera was: a point p of the camera lies at rotation * p +
  /// translation (metres) in the world. Throws std::invalid_argument also for a rotation that is
  /// not orthonormal to 1e-3.
  void add(const FrameView& frame, const cv::Matx33d& rotation, const cv::Vec3d& translation);

  /// Puts the sequence into the folder, in the place of an earlier one. No frame can be added
  /// afterwards; a second call does nothing. Throws std::runtime_error that names the file that
  /// cannot be written or is in the way; the folder then holds what it held.
  void finish();

  /// Frames that were added.
  std::size_t size() const { return rows_.size(); }

 private:
  struct Row {
    std::string time;
    std::string pose_row;  // of groundtruth.txt; empty: not known
  };

  void require_frame(const FrameView& frame) const;
  void write_frame(const FrameView& frame, std::string pose_row);
  void write_lists() const;

  CameraParameters camera_;
  std::string camera_text_;
  std::unique_ptr<detail::StagedFolder> staged_;  // none after finish()
  std::list<Row> rows_;
  bool has_depth_ = false;
  std::int64_t last_time_ = 0;  // microseconds
};

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_RGBD_SEQUENCE_WRITER_HPP
