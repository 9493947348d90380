// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Folders of images whose names are times.

#ifndef DYNFILTER_SRC_IO_OUTPUT_FOLDER_HPP
#define DYNFILTER_SRC_IO_OUTPUT_FOLDER_HPP

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Reads the time that a file's stem spells, as in 1341846434.710184.png.
inline std::optional<double> time_of_stem(const std::string& stem) {
  const std::optional<double> time_s = parse_number(stem);
  if (!time_s || !is_time_in_seconds(*time_s)) return {};
  return time_s;
}

/// Lists the PNG files of a folder; none if there is no such folder.
inline std::vector<std::filesystem::path> png_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".png" && entry.is_regular_file())
      files.push_back(entry.path());
  }
  return files;
}

/// Lists the PNG files of a folder whose names are times.
inline std::vector<std::filesystem::path> timed_png_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& file : png_files(folder)) {
    if (time_of_stem(file.stem().string())) files.push_back(file);
  }
  return files;
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_OUTPUT_FOLDER_HPP
