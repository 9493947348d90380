// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_MASK_FOLDER_SEGMENTER_HPP
#define DYNFILTER_SEGMENTERS_MASK_FOLDER_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {

struct MaskFolderOptions {
  /// Between a frame and the mask that is its own.
  double max_time_difference_s = 0.001;
  /// Binary masks only: how far the box reaches beyond the object, for the detector's is not known
  /// and edge features lie outside the mask. On TUM fr3 a person's depth edge lies within 14 px of
  /// a network's mask in 95 % of the rows, and boxes that reach further than 20 px catch no more.
  int box_margin_px = 20;
  /// Binary masks only: smaller objects are left out. 1 = all are kept.
  int min_pixels = 1;
  /// Whether masks may be missing: the folder may hold none, and rows of the table may be of frames
  /// that have no file. The masks of such a frame are unknown, see has_mask.
  bool allow_missing = false;
};

/// Takes the instances of a frame from a folder of PNG files named by time, 1341846434.710184.png.
/// A frame's mask is the one nearest in time, within `max_time_difference_s`. Two formats:
///
/// Label maps, where there is `instances.csv` (frame,instance,class_id,score,x,y,width,height): 8
/// or 16 bits, 0 = background, k = instance k of the frame. Instances come in the order of their
/// numbers, with class, score and box of the table; one may have no pixel and then no mask. A file
/// without rows in the table is a frame without instances.
///
/// Binary masks, where there is none: 0 and non-zero. Every connected object is one instance of
/// class 0 and score 1 (see instances_from_binary_mask).
///
/// Neither image nor depth is needed; where there is one, the mask must be of its size. track_id is
/// never set. Frames are looked up by time alone; any order will do. The files must not
/// change while the segmenter lives.
class MaskFolderSegmenter final : public Segmenter {
 public:
  /// Reads the table and the names of the masks, decodes none. Throws std::runtime_error that names
  /// file and line for a folder that is absent or cannot be read, a PNG file whose name is no time
  /// (a mask that no frame would find), two for one time, a mask or table that is no regular file,
  /// a table whose header is another, a row that is short or malformed, and an instance that occurs
  /// twice; unless `allow_missing`, for a folder that has no PNG file and rows of a frame that has
  /// none, too. Throws std::invalid_argument for options that are negative. O(n log n) of files and
  /// rows.
  explicit MaskFolderSegmenter(const std::filesystem::path& folder,
                               const MaskFolderOptions& options = {});

  /// How many masks the folder has.
  std::size_t size() const { return masks_.size(); }

  /// Whether there is a mask for a frame of this time. O(log n).
  bool has_mask(double timestamp_s) const;

 private:
  struct Mask {
    std::filesystem::path path;
    std::map<int, Instance> instances;  // by label; without masks; of the table
  };
  using Masks = std::map<std::int64_t, Mask>;  // by time in microseconds

  /// Throws std::runtime_error that names the file for a mask that is missing, cannot be decoded,
  /// has another size than the frame or more than one channel, and a label that the table lacks.
  Segmentation do_segment(const FrameView& frame) override;

  void index_masks();
  void read_table(const std::filesystem::path& path);
  Masks::const_iterator nearest(double time_s) const;
  bool is_within_reach(Masks::const_iterator mask, double time_s) const;

  std::filesystem::path folder_;
  MaskFolderOptions options_;
  bool has_table_ = false;
  Masks masks_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_MASK_FOLDER_SEGMENTER_HPP
