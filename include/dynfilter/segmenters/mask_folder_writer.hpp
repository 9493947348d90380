// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_MASK_FOLDER_WRITER_HPP
#define DYNFILTER_SEGMENTERS_MASK_FOLDER_WRITER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <set>
#include <string>

#include "dynfilter/segmentation.hpp"

namespace dynfilter {
namespace detail {
class StagedFolder;
}

struct MaskFolderWriterOptions {
  /// Whether masks that an earlier MaskFolderWriter wrote into the folder may be replaced.
  bool overwrite = false;
};

/// Writes segmentations as label maps with an instances.csv: the first format that
/// MaskFolderSegmenter reads. Instance i of a segmentation is label i+1.
///
/// A label map has one label a pixel: where masks overlap, the pixel is that of the instance with
/// the lowest index. Parts of a mask outside the image are cut off; boxes are written as they are;
/// scores have 6 decimals; track_id is not written.
///
/// The masks appear in the folder all together, with finish(). Before it, and where a writer is
/// destroyed without it, fails or is killed, the folder holds what it held. Files are collected in
/// a hidden folder, .dynfilter-masks-<process id>; .dynfilter-masks.txt lists what was written, so
/// that a later writer knows what it may replace.
class MaskFolderWriter {
 public:
  /// Makes the folder where needed. Throws std::runtime_error that names what is in the way: a file
  /// instances.csv, a PNG file whose name is a time, and anything that an earlier writer wrote.
  /// With `overwrite` that is only what no earlier writer wrote, or what was changed since. Throws
  /// std::runtime_error also while another writer is at work in the folder.
  explicit MaskFolderWriter(const std::filesystem::path& folder,
                            const MaskFolderWriterOptions& options = {});
  MaskFolderWriter(MaskFolderWriter&&) noexcept;
  MaskFolderWriter& operator=(MaskFolderWriter&&) noexcept;
  ~MaskFolderWriter();

  /// Adds <timestamp_s with 6 decimals>.png, 8 bits, or 16 where there are more than 255
  /// instances, and their rows. All or nothing: what failed can be added again. Throws
  /// std::invalid_argument for a segmentation that is malformed (see validate), has no image size
  /// or more than 65535 instances, whose time was written before, and after finish(), with nothing
  /// written; std::runtime_error that names the file that cannot be written. O(pixels + area of the
  /// masks).
  void add(const Segmentation& segmentation);

  /// The same under the name of the frame's image without folder and extension:
  /// RgbdSequenceEntry::stem. Throws std::invalid_argument also for a stem that is no time in
  /// seconds, and for one more than 1 ms from timestamp_s, under which MaskFolderSegmenter would
  /// not find the frame's mask.
  void add(const Segmentation& segmentation, const std::string& stem);

  /// Puts the masks into the folder, in the place of earlier ones. No frame can be added
  /// afterwards; a second call does nothing. Throws std::runtime_error that names the file that
  /// cannot be written or is in the way; the folder then holds what it held.
  void finish();

  /// Frames that were added.
  std::size_t size() const { return times_.size(); }

 private:
  std::unique_ptr<detail::StagedFolder> staged_;  // none after finish()
  std::list<std::string> rows_;                   // of instances.csv, of a frame each
  std::set<std::int64_t> times_;                  // microseconds
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_MASK_FOLDER_WRITER_HPP
