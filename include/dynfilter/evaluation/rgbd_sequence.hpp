// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/evaluation/sequence_camera.hpp"
#include "dynfilter/frame.hpp"

namespace dynfilter {

/// Options of RgbdSequence.
struct RgbdSequenceOptions {
  /// Largest difference in time between a colour image, moved by depth_offset_s, and its depth
  /// image, if images are paired by time.
  double max_time_difference_s = 0.02;
  /// Camera file or name, see read_camera; empty = camera.yaml in the sequence's folder or, where
  /// there is depth, camera_intrinsic.json, intrinsic.json or transforms.json.
  std::filesystem::path camera_file = {};
  /// Offset of the depth's stamps, seconds: a colour image of time t belongs with the depth image
  /// whose stamp is nearest to t + depth_offset_s. Positive: depth is late, a depth image shows the
  /// scene as it was before its stamp. TUM's is late by about one frame, +0.033 s. (One public
  /// system writes -0.033 for the same.) Without a value, the camera file's SequenceCamera::
  /// depth_offset_s.
  std::optional<double> depth_offset_s = {};
  /// Whether a missing camera file is an error where there is depth. Without one, SequenceCamera
  /// are all 0 and 16-bit depth has no metres_per_unit.
  bool needs_camera = true;
  /// Whether images without depth are frames, too: listed ones, and those beside them.
  bool keeps_unpaired = false;
};

/// One frame of a sequence, not decoded.
struct RgbdSequenceEntry {
  double timestamp_s = 0;            ///< time of the colour image
  std::filesystem::path image_path;  ///< path including the sequence's folder
  double depth_timestamp_s = 0;      ///< time of the depth image; timestamp_s without one
  std::filesystem::path depth_path;  ///< path of the depth image; empty without one
  std::string stem;                  ///< image_path without folder and extension; names the masks
  bool has_time = true;              ///< false: the time is made up, 30 images a second
};

/// Recorded sequence in the layout of the TUM RGB-D benchmark and of BONN RGB-D Dynamic.
///
/// Its frames, in the order of time, are the rows of `associations.txt` (t_rgb rgb/… t_depth
/// depth/…), or else the images of `rgb.txt` and `depth.txt` (t file) that `associate` pairs; or
/// those of OpenLORIS, EuRoC's data.csv (also in mav0/cam0 or cam0) or KITTI's times.txt; or else
/// the images that lie in the folder, whose times are those in the names, or 30 a second. Depth
/// that no list names is paired by the times, or else the numbers, in the names; see note.
/// With an offset, pairs are paired anew, too.
class RgbdSequence {
 public:
  /// Reads the lists and the camera file, and checks that the frames' images exist; decodes none.
  /// `#` comments, any ends of lines, UTF-16 and nanoseconds are accepted. O(n log n).
  ///
  /// Throws std::runtime_error that names the file, and the line if there is one, for a folder,
  /// list or image that is missing, unreadable or not a regular file (in a truncated download, it
  /// counts the missing images); for a row that is short, has no time, or the time of another; for
  /// a sequence without frames; and for a camera file that is malformed or missing (it shows the
  /// text to write). Throws std::invalid_argument for options out of range.
  explicit RgbdSequence(const std::filesystem::path& folder,
                        const RgbdSequenceOptions& options = {});

  /// Number of frames.
  std::size_t size() const { return entries_.size(); }

  /// Returns the entry of frame i. Throws std::invalid_argument for i >= size().
  const RgbdSequenceEntry& entry(std::size_t i) const;

  /// Decodes frame i: id = i, time of the colour image, image CV_8UC3 (BGR), depth CV_16UC1 with
  /// metres_per_unit = 1 / DepthMapFactor and 0 for the type's maximum, or CV_32FC1 in metres.
  /// Depth of another size and the image's shape is resized by the nearest neighbour. The frame
  /// owns its pixels. Several threads may call it at once.
  ///
  /// Throws std::invalid_argument for i >= size(). Throws std::runtime_error that names the file
  /// that cannot be read or decoded, a depth image of another type or shape than expected, or an
  /// image whose size differs from the camera file.
  FrameView read(std::size_t i) const;

  /// Returns the times of frames by the names of their images: MaskFolderOptions::frame_times.
  /// Has the listed images without depth, too; leaves out names that occur twice.
  const std::map<std::string, double>& times_by_stem() const { return times_by_stem_; }

  /// Camera of the sequence.
  const SequenceCamera& camera() const { return camera_; }
  /// Folder of the sequence.
  const std::filesystem::path& folder() const { return folder_; }
  /// Offset that the frames were paired with, seconds.
  double depth_offset_s() const { return depth_offset_s_; }
  /// What was found without a list, as "120 colour images of color/, 118 depth images of depth/";
  /// empty if lists name all images.
  const std::string& note() const { return note_; }
  /// Number of listed images without a depth image, where there is depth.
  std::size_t unpaired() const { return unpaired_; }
  /// Whether the frames have depth.
  bool has_depth() const { return has_depth_; }

  /// @{
  /// File or folder of the sequence, if it exists: groundtruth.txt, masks/, masks_true/ or
  /// masks_moving/. Throws std::runtime_error that names a path that cannot be inspected, a
  /// groundtruth.txt that is not a regular file, or masks that are not in a folder.
  std::optional<std::filesystem::path> groundtruth_file() const;
  std::optional<std::filesystem::path> masks_folder() const { return subfolder("masks"); }
  std::optional<std::filesystem::path> true_masks_folder() const { return subfolder("masks_true"); }
  std::optional<std::filesystem::path> moving_masks_folder() const {
    return subfolder("masks_moving");
  }
  /// @}

 private:
  std::optional<std::filesystem::path> subfolder(const char* name) const;

  std::filesystem::path folder_;
  bool has_depth_ = false;
  std::size_t unpaired_ = 0;
  std::string note_;
  std::vector<RgbdSequenceEntry> entries_;
  std::map<std::string, double> times_by_stem_;
  std::filesystem::path camera_file_;
  SequenceCamera camera_;
  double depth_offset_s_ = 0;
};

}  // namespace dynfilter
