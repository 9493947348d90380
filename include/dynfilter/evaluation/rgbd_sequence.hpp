// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_RGBD_SEQUENCE_HPP
#define DYNFILTER_EVALUATION_RGBD_SEQUENCE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/frame.hpp"

namespace dynfilter {

struct RgbdSequenceOptions {
  /// Between a colour and a depth image, where the sequence brings no associations.txt.
  double max_time_difference_s = 0.02;
  /// The camera file; empty = camera.yaml in the sequence's folder.
  std::filesystem::path camera_file = {};
};

/// One frame of a sequence, not yet decoded.
struct RgbdSequenceEntry {
  double timestamp_s = 0;            ///< of the colour image
  std::filesystem::path image_path;  ///< with the sequence's folder
  double depth_timestamp_s = 0;      ///< timestamp_s where there is no depth
  std::filesystem::path depth_path;  ///< empty where there is no depth
  std::string stem;                  ///< image_path without folder and extension: names the masks
};

/// A recorded sequence in the layout of the TUM RGB-D benchmark and of BONN RGB-D Dynamic.
///
/// The frames are those of `associations.txt` (t_rgb rgb/… t_depth depth/…) where it exists,
/// whatever the time differences in it. Else the images of `rgb.txt` and `depth.txt` (t file) are
/// associated by `associate`, and those without a partner left out; without `depth.txt` the
/// sequence has colour only. Frames are in the order of their time, and so are they when the file's
/// rows are not.
/// `#` comments, blank lines and CR LF are accepted in all of them.
class RgbdSequence {
 public:
  /// Reads the lists and the camera file, and looks whether all images of the frames exist; decodes
  /// none. (The images of frames only: one that is listed in rgb.txt and has no partner may be
  /// missing. In a truncated download, others are, and the refusal counts them.)
  ///
  /// Throws std::runtime_error that names the file, and the line where there is one: for a folder,
  /// a list or an image that is missing, cannot be read or is no regular file (a FIFO, a device; it
  /// is not opened), a row that is short or whose time is not a finite number,
  /// times that stand in the colour list or in depth.txt twice, no frame at all, and a camera file
  /// that is malformed; a missing camera file is answered with the text to write. Throws
  /// std::invalid_argument for a negative max_time_difference_s. O(n log n) of the images.
  explicit RgbdSequence(const std::filesystem::path& folder,
                        const RgbdSequenceOptions& options = {});

  std::size_t size() const { return entries_.size(); }

  /// Throws std::invalid_argument for i >= size(), as read does.
  const RgbdSequenceEntry& entry(std::size_t i) const;

  /// Decodes frame i: id = i, time of the colour image, image CV_8UC3 (BGR), depth CV_16UC1 or
  /// CV_32FC1 as the file has it, metres_per_unit = 1 / DepthMapFactor for either type. The frame
  /// owns its pixels. May be called from several threads at once. Throws std::runtime_error that
  /// names the file that cannot be read or decoded, the depth image of another type or another size
  /// than the colour image, and the image of another size than the camera file says.
  FrameView read(std::size_t i) const;

  const CameraParameters& camera() const { return camera_; }
  const std::filesystem::path& folder() const { return folder_; }
  bool has_depth() const { return has_depth_; }

  /// groundtruth.txt, masks/ and masks_true/ of the folder, where they exist. Throw
  /// std::runtime_error that names what cannot be looked at, and a groundtruth.txt that is no
  /// regular file.
  std::optional<std::filesystem::path> groundtruth_file() const;
  std::optional<std::filesystem::path> masks_folder() const;
  std::optional<std::filesystem::path> true_masks_folder() const;

 private:
  std::filesystem::path folder_;
  bool has_depth_ = false;
  std::vector<RgbdSequenceEntry> entries_;
  std::filesystem::path camera_file_;
  CameraParameters camera_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_RGBD_SEQUENCE_HPP
