// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DATASETS_RGBD_SEQUENCE_WRITER_HPP
#define DYNFILTER_DATASETS_RGBD_SEQUENCE_WRITER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>

#include <opencv2/core.hpp>

#include "dynfilter/datasets/camera.hpp"
#include "dynfilter/frame.hpp"

namespace dynfilter {

struct RgbdSequenceWriterOptions {
  /// Whether an earlier sequence in the folder may be replaced.
  bool overwrite = false;
};

/// Writes frames as a sequence in the layout that RgbdSequence reads: camera.yaml, rgb/, rgb.txt,
/// with depth also depth/, depth.txt and associations.txt, with poses groundtruth.txt. Images are
/// named by their time, 1341846434.710184.png.
///
/// What add() has returned from is in the files: rows are written after the images that they name.
/// A writer that is destroyed without finish() loses nothing.
class RgbdSequenceWriter {
 public:
  /// Makes the folder where needed and writes camera.yaml. A folder that holds camera.yaml, a list
  /// or an image in rgb/ or depth/ whose name is a time is refused (std::runtime_error that names
  /// what it holds), unless `overwrite` is set: then these files are removed, and no others. Throws
  /// std::invalid_argument for a camera that write_camera refuses, before anything is removed.
  RgbdSequenceWriter(const std::filesystem::path& folder, const CameraParameters& camera,
                     const RgbdSequenceWriterOptions& options = {});
  RgbdSequenceWriter(RgbdSequenceWriter&&) noexcept;
  RgbdSequenceWriter& operator=(RgbdSequenceWriter&&) noexcept;
  ~RgbdSequenceWriter();

  /// Writes a frame whose pose is not known. Its time must be a microsecond after the last one's at
  /// least; the image CV_8UC1 or CV_8UC3; the depth CV_16UC1 or CV_32FC1, written in the units of
  /// the camera's DepthMapFactor (unchanged where metres_per_unit says the same; else rounded to
  /// the nearest unit, and 0 where a 16-bit image cannot hold it), or empty in every frame. Throws
  /// std::invalid_argument for a frame that is not so, for one whose size is not the camera's, and
  /// after finish(), with nothing written; std::runtime_error that names the file that cannot be
  /// written. O(pixels).
  void add(const FrameView& frame);

  /// The same, with where the camera was: a point p of the camera lies at rotation * p +
  /// translation (metres) in the world. Throws std::invalid_argument also for a rotation that is
  /// not orthonormal to 1e-3.
  void add(const FrameView& frame, const cv::Matx33d& rotation, const cv::Vec3d& translation);

  /// Closes the files. No frame can be added afterwards; a second call does nothing. Throws
  /// std::runtime_error that names the file that could not be written.
  void finish();

  /// Frames that were added.
  std::size_t size() const { return size_; }

 private:
  struct Lists;

  void require_frame(const FrameView& frame) const;
  void write_frame(const FrameView& frame);

  std::filesystem::path folder_;
  CameraParameters camera_;
  std::unique_ptr<Lists> lists_;  // none after finish()
  std::size_t size_ = 0;
  std::int64_t last_time_ = 0;  // microseconds
};

}  // namespace dynfilter

#endif  // DYNFILTER_DATASETS_RGBD_SEQUENCE_WRITER_HPP
