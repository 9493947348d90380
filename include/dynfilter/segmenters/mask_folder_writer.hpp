// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dynfilter/segmentation.hpp"

namespace dynfilter {
namespace detail {
class StagedFolder;
}

/// Options of MaskFolderWriter.
struct MaskFolderWriterOptions {
  /// Whether masks that an earlier MaskFolderWriter wrote into the folder may be replaced.
  bool overwrite = false;
  /// Whether frames may have any names, not only times. To read such masks, name the frames in
  /// MaskFolderOptions::frame_times.
  bool any_names = false;
};

/// Writes segmentations as label maps with an instances.csv: the first format that
/// MaskFolderSegmenter reads. Instance i of a segmentation is label i+1.
///
/// A label map has one label per pixel: where masks overlap, the instance with the lowest index
/// gets the pixel. Parts of a mask outside the image are cut off, boxes are written unchanged,
/// scores have 6 decimals, and track_id is not written.
///
/// The masks appear in the folder with finish(). Until then the folder keeps its contents, and
/// files are collected in a hidden folder in it. `.dynfilter-masks.txt` lists what was written, so
/// that a later writer knows what it may replace.
class MaskFolderWriter {
 public:
  /// Makes the folder if needed. Throws std::runtime_error for a folder that holds files, except
  /// with `overwrite` one that an earlier MaskFolderWriter wrote: its files are replaced, others
  /// are kept, and no other may be a PNG, which MaskFolderSegmenter would read.
  explicit MaskFolderWriter(const std::filesystem::path& folder,
                            const MaskFolderWriterOptions& options = {});
  /// Moves the writer; the source may only be destroyed or assigned to.
  MaskFolderWriter(MaskFolderWriter&&) noexcept;
  /// Moves the writer; the source may only be destroyed or assigned to.
  MaskFolderWriter& operator=(MaskFolderWriter&&) noexcept;
  ~MaskFolderWriter();

  /// Adds a frame's masks as `<timestamp_s with 6 decimals>.png`, and their rows. The file has 8
  /// bits, or 16 for more than 255 instances. A call that fails adds nothing and can be repeated.
  ///
  /// Throws std::invalid_argument for a segmentation that is malformed (see validate), has no image
  /// size or more than 65535 instances, for a time that was added before, and after finish().
  /// Throws std::runtime_error that names the file that cannot be written. O(pixels + area of the
  /// masks).
  void add(const Segmentation& segmentation);

  /// Adds a frame's masks under the name of its image without folder and extension:
  /// RgbdSequenceEntry::stem. Unless `any_names`, throws std::invalid_argument also for a stem that
  /// is not a time in seconds or nanoseconds, and for one more than 1 ms from timestamp_s, where
  /// MaskFolderSegmenter would not find the mask.
  ///
  /// Masks may be late: made of an earlier image, that of segmentation.timestamp_s. If the frame's
  /// time differs from it by more than 1 ms, the table gets the column mask_time. Masks without
  /// instances have no row, so their time is lost.
  void add(const Segmentation& segmentation, const std::string& stem,
           std::optional<double> frame_timestamp_s = {});

  /// Moves the masks into the folder and replaces earlier ones. No frame can be added afterwards; a
  /// second call does nothing. Throws std::invalid_argument if no frame was added, and
  /// std::runtime_error that names the file that cannot be written or is in the way, which the
  /// writer never replaces.
  void finish();

  /// Number of frames added.
  std::size_t size() const { return times_.size(); }

 private:
  struct Row {
    std::string text, mask_time;  // the last column stands alone
  };

  std::unique_ptr<detail::StagedFolder> staged_;  // null after finish()
  std::vector<Row> rows_;                         // of instances.csv, frame by frame
  bool has_own_times_ = false;                    // whether any masks are of another image
  std::set<std::int64_t> times_;                  // microseconds
  bool any_names_ = false;
};

}  // namespace dynfilter
