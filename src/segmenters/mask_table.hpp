// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What the reader and the writer of mask folders agree on.

#ifndef DYNFILTER_SRC_SEGMENTERS_MASK_TABLE_HPP
#define DYNFILTER_SRC_SEGMENTERS_MASK_TABLE_HPP

#include <filesystem>
#include <vector>

#include "io/output_folder.hpp"

namespace dynfilter::detail {

constexpr const char* mask_table_name = "instances.csv";
constexpr const char* mask_table_header = "frame,instance,class_id,score,x,y,width,height";
constexpr int max_mask_label = 65535;  // of a 16-bit PNG

/// What a writer of masks writes into <folder>/<masks>, and what of that kind is there: names
/// relative to the folder.
inline std::vector<std::filesystem::path> mask_names(const std::filesystem::path& folder,
                                                     const std::filesystem::path& masks = {}) {
  std::vector<std::filesystem::path> names = {masks / mask_table_name};
  for (const std::filesystem::path& file : timed_png_files(folder / masks)) {
    names.push_back(masks / file.filename());
  }
  return names;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_MASK_TABLE_HPP
