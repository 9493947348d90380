// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_MASK_FOLDER_WRITER_HPP
#define DYNFILTER_SEGMENTERS_MASK_FOLDER_WRITER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "dynfilter/segmentation.hpp"

namespace dynfilter {
namespace detail {
class TableWriter;
}

struct MaskFolderWriterOptions {
  /// Whether earlier masks in the folder may be replaced.
  bool overwrite = false;
};

/// Writes segmentations as label maps with an instances.csv: the first format that
/// MaskFolderSegmenter reads. Instance i of a segmentation is label i+1.
///
/// A label map has one label a pixel: where masks overlap, the pixel is that of the instance with
/// the lowest index. Parts of a mask outside the image are cut off; boxes are written as they are;
/// scores have 6 decimals; track_id is not written.
///
/// What add() has returned from is in the files. A writer that is destroyed without finish() loses
/// nothing.
class MaskFolderWriter {
 public:
  /// Makes the folder where needed, and instances.csv. A folder that holds instances.csv or a PNG
  /// file whose name is a time is refused (std::runtime_error that names what it holds), unless
  /// `overwrite` is set: then these files are removed, and no others.
  explicit MaskFolderWriter(const std::filesystem::path& folder,
                            const MaskFolderWriterOptions& options = {});
  MaskFolderWriter(MaskFolderWriter&&) noexcept;
  MaskFolderWriter& operator=(MaskFolderWriter&&) noexcept;
  ~MaskFolderWriter();

  /// Writes <timestamp_s with 6 decimals>.png, 8 bits, or 16 where there are more than 255
  /// instances, and their rows. Throws std::invalid_argument for a segmentation that is malformed
  /// (see validate), has no image size or more than 65535 instances, whose time was written before,
  /// and after finish(), with nothing written; std::runtime_error that names the file that cannot
  /// be written. O(pixels + area of the masks).
  void add(const Segmentation& segmentation);

  /// The same under the name of the frame's image without folder and extension:
  /// RgbdSequenceEntry::stem. Throws std::invalid_argument also for a stem that is no time in
  /// seconds, and for one more than 1 ms from timestamp_s, under which MaskFolderSegmenter would
  /// not find the frame's mask.
  void add(const Segmentation& segmentation, const std::string& stem);

  /// Closes the table. No frame can be added afterwards; a second call does nothing. Throws
  /// std::runtime_error that names the file that could not be written.
  void finish();

  /// Frames that were added.
  std::size_t size() const { return times_.size(); }

 private:
  std::filesystem::path folder_;
  std::unique_ptr<detail::TableWriter> table_;  // none after finish()
  std::set<std::int64_t> times_;                // microseconds
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_MASK_FOLDER_WRITER_HPP
