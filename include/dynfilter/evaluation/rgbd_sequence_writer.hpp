// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_RGBD_SEQUENCE_WRITER_HPP
#define DYNFILTER_EVALUATION_RGBD_SEQUENCE_WRITER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/frame.hpp"

namespace dynfilter {
namespace detail {
class StagedFolder;
}

/// Options of RgbdSequenceWriter.
struct RgbdSequenceWriterOptions {
  /// Whether a sequence that an earlier RgbdSequenceWriter wrote into the folder may be replaced.
  bool overwrite = false;
};

/// Writes frames as a sequence in the layout that RgbdSequence reads: camera.yaml, rgb/, rgb.txt,
/// with depth also depth/, depth.txt and associations.txt, with poses groundtruth.txt. Images are
/// named by their time, 1341846434.710184.png.
///
/// The sequence appears in the folder with finish(). Until then the folder keeps its contents, and
/// files are collected in a hidden folder in it. `.dynfilter-sequence.txt` lists what was written,
/// so that a later writer knows what it may replace.
class RgbdSequenceWriter {
 public:
  /// Makes the folder if needed. Throws std::runtime_error for a folder that holds files, except
  /// with `overwrite` one that an earlier RgbdSequenceWriter wrote: its files are replaced, others
  /// are kept. Throws std::invalid_argument for a camera that write_camera refuses.
  RgbdSequenceWriter(const std::filesystem::path& folder, const CameraParameters& camera,
                     const RgbdSequenceWriterOptions& options = {});
  /// Moves the writer; the source may only be destroyed or assigned to.
  RgbdSequenceWriter(RgbdSequenceWriter&&) noexcept;
  /// Moves the writer; the source may only be destroyed or assigned to.
  RgbdSequenceWriter& operator=(RgbdSequenceWriter&&) noexcept;
  ~RgbdSequenceWriter();

  /// Adds a frame whose pose is not known. The frame must have
  /// - a time at least a microsecond after the last one's;
  /// - an image of type CV_8UC1 or CV_8UC3 and of the camera's size;
  /// - depth of type CV_16UC1 or CV_32FC1, or none in every frame.
  ///
  /// Depth is written in the units of the camera's DepthMapFactor: unchanged if metres_per_unit
  /// agrees, otherwise rounded to the nearest unit, and 0 if a 16-bit image cannot hold it.
  ///
  /// Throws std::invalid_argument for another frame and after finish(), and std::runtime_error that
  /// names the file that cannot be written. A call that fails adds nothing. O(pixels).
  void add(const FrameView& frame);

  /// Adds a frame with the camera's pose: a point p in the camera's frame lies at rotation * p +
  /// translation (metres) in the world. Throws std::invalid_argument also for a rotation that is
  /// not orthonormal to 1e-3.
  void add(const FrameView& frame, const cv::Matx33d& rotation, const cv::Vec3d& translation);

  /// Moves the sequence into the folder and replaces an earlier one. No frame can be added
  /// afterwards; a second call does nothing. Throws std::runtime_error that names the file that
  /// cannot be written or is in the way, which the writer never replaces.
  void finish();

  /// Number of frames added.
  std::size_t size() const { return rows_.size(); }

 private:
  struct Row {
    std::string time;
    std::string pose_row;  // row of groundtruth.txt; empty = unknown
  };

  void require_frame(const FrameView& frame) const;
  void write_frame(const FrameView& frame, const std::string& pose_row);
  void write_lists() const;

  CameraParameters camera_;
  std::string camera_text_;
  std::unique_ptr<detail::StagedFolder> staged_;  // null after finish()
  std::vector<Row> rows_;
  bool has_depth_ = false;
  std::int64_t last_time_ = 0;  // microseconds
};

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_RGBD_SEQUENCE_WRITER_HPP
