// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/segmenter.hpp"

namespace dynfilter::tools {

/// The masks that a user has for the frames of a sequence.
struct RecordedMasks {
  std::unique_ptr<Segmenter> segmenter;
  std::function<bool(double time_s)> has_mask;
  std::function<std::vector<int>()> values;  ///< different values of masks without a table
  std::string note;                          ///< ids of classes that are not COCO's; empty: none
  bool may_be_missing;

  /// Returns the masks of a frame; none if they are missing, and may be.
  std::optional<Segmentation> of(FrameView frame) const {
    if (may_be_missing && !has_mask(frame.timestamp_s)) return {};
    frame.depth.release();  // without a camera file, its unit is not known
    return segmenter->segment(frame);
  }
};

/// Opens a folder of MaskFolderSegmenter's, or what other tools write: COCO's JSON, annotations or
/// results, with polygons, RLE or boxes; a folder of YOLO's labels, polygons or boxes; CVAT's
/// colours with labelmap.txt; ids of MOTS or Cityscapes, 1000 a class; or several mask files an
/// image. Classes are COCO's by their names, and persons where there is one class alone. Throws
/// std::runtime_error that names a file that cannot be read, or if nothing is of a frame, of which
/// `times` has the names.
RecordedMasks open_masks(const std::filesystem::path& path,
                         const std::map<std::string, double>& times, bool may_be_missing);

}  // namespace dynfilter::tools
