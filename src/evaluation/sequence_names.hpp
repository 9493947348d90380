// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_EVALUATION_SEQUENCE_NAMES_HPP
#define DYNFILTER_SRC_EVALUATION_SEQUENCE_NAMES_HPP

#include <filesystem>
#include <vector>

#include "io/output_folder.hpp"

namespace dynfilter::detail {

/// Names what a sequence writer writes into the folder, plus the files of these kinds that are
/// there; all relative to the folder.
inline std::vector<std::filesystem::path> sequence_names(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> names = {
      "camera.yaml",     "rgb.txt", "depth.txt", "associations.txt",
      "groundtruth.txt", "rgb/",    "depth/"};
  for (const char* images : {"rgb", "depth"}) {
    for (const std::filesystem::path& file : timed_png_files(folder / images)) {
      names.push_back(images / file.filename());
    }
  }
  return names;
}

/// Names the lists that make a folder a sequence: no reader accepts it without them.
inline std::vector<std::filesystem::path> sequence_keys() {
  return {"rgb.txt", "associations.txt"};
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_EVALUATION_SEQUENCE_NAMES_HPP
