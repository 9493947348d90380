// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {

/// Options of MaskFolderSegmenter.
struct MaskFolderOptions {
  /// Largest difference in time between a frame and its mask, seconds. A mask that is more than
  /// 0.001 s away was made of another image.
  double max_time_difference_s = 0.001;
  /// Margin of the box around the object, pixels. The detector's box is not known, and edge
  /// features lie outside the mask. On TUM fr3 a person's depth edge lies within 14 px of a
  /// network's mask in 95 % of the rows, and margins above 20 px catch no more. Binary masks only.
  int box_margin_px = 20;
  /// Whether masks may be missing. Then the folder may be empty, and rows of the table may refer to
  /// frames that have no file. The masks of such a frame are unknown, see has_mask.
  bool allow_missing = false;
  /// Times of the frames by their names, for masks that are named like the images. Names that are
  /// not here are times.
  std::map<std::string, double> frame_times = {};
};

/// Reads the instances of a frame from a folder of PNG files named by time, 1341846434.710184.png,
/// nanoseconds, `<time>_mask.png` or COLMAP's `<image>.png`: the nearest within
/// `max_time_difference_s`. With `instances.csv` (frame,instance,class_id,score,x,y,width,height
/// and maybe mask_time, of the image that the masks were made of) they are label maps. Without,
/// every connected object of a mask is one of class 0 and score 1 (instances_from_binary_mask).
///
/// A palette counts by its indices; three channels must be equal, and what is transparent is 0. A
/// mask of the frame's shape, at most 4 times as wide, is resized by the nearest neighbour, and the
/// table's boxes, which are in the mask's pixels, are scaled. The files must not change. Several
/// threads may call segment at once.
class MaskFolderSegmenter final : public Segmenter {
 public:
  /// Segmentation::frame_id of masks that were made of another image than the frame's.
  static constexpr std::uint64_t unknown_frame = std::numeric_limits<std::uint64_t>::max();

  /// Reads the table and the names of the masks; decodes none. O(n log n) of files and rows. Throws
  /// std::runtime_error that names file and line for a folder that cannot be read, a PNG file whose
  /// name is not a time or numbers the frames, two files for one time, a mask or table that is not
  /// a regular file, a malformed table and, unless `allow_missing`, a folder without PNG files and
  /// rows of a frame without a file. Throws std::invalid_argument for negative options.
  explicit MaskFolderSegmenter(const std::filesystem::path& folder,
                               const MaskFolderOptions& options = {});

  /// Number of masks in the folder.
  std::size_t size() const { return masks_.size(); }

  /// Whether there is a mask for a frame of this time. O(log n).
  bool has_mask(double timestamp_s) const;

  /// Returns the different non-zero values of at most 30 of the masks, in rising order: more than
  /// one hints at classes, or soft masks. Reads them anew; skips those that cannot be read. Returns
  /// none where there is a table.
  std::vector<int> values() const;

 private:
  struct Mask {
    std::filesystem::path path;
    std::map<int, Instance> instances;  // rows of the table by label, without masks
    std::optional<double> time_s;       // mask_time of these rows
  };
  using Masks = std::map<std::int64_t, Mask>;  // by time in microseconds

  /// Reads the frame's mask. Throws std::runtime_error that names the file for a mask that is
  /// missing, cannot be decoded, or differs from the frame in shape, for one in colours, and for a
  /// label that the table lacks.
  Segmentation do_segment(const FrameView& frame) override { return read(frame); }

  Segmentation read(const FrameView& frame) const;
  std::optional<double> time_of(const std::string& stem) const;
  void index_masks();
  void read_table(const std::filesystem::path& path);
  Masks::const_iterator nearest(double time_s) const;
  bool is_near(Masks::const_iterator mask, double time_s, double reach_s) const;

  std::filesystem::path folder_;
  MaskFolderOptions options_;
  bool has_table_ = false;
  Masks masks_;
};

}  // namespace dynfilter
