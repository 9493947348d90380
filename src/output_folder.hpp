// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Folders of images whose names are times, and the policy of the components that write them.

#ifndef DYNFILTER_SRC_OUTPUT_FOLDER_HPP
#define DYNFILTER_SRC_OUTPUT_FOLDER_HPP

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/detail/number_text.hpp"
#include "file_error.hpp"

namespace dynfilter::detail {

/// The time that a file's name is, without its extension: 1341846434.710184.png.
inline std::optional<double> time_of_stem(const std::string& stem) {
  const std::optional<double> time_s = parse_number(stem);
  if (!time_s || !is_time_in_seconds(*time_s)) return {};
  return time_s;
}

/// The PNG files of a folder; none if there is no such folder.
inline std::vector<std::filesystem::path> png_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".png" && entry.is_regular_file())
      files.push_back(entry.path());
  }
  return files;
}

/// Those of them whose names are times: what the writers write.
inline std::vector<std::filesystem::path> timed_png_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& file : png_files(folder)) {
    if (time_of_stem(file.stem().string())) files.push_back(file);
  }
  return files;
}

/// Before a writer begins: removes the `earlier` output in `folder`, or throws std::runtime_error
/// where there is some and it must not be overwritten. Nothing else in the folder is touched.
inline void make_room(const std::filesystem::path& folder,
                      const std::vector<std::filesystem::path>& earlier, bool overwrite) {
  for (const std::filesystem::path& file : earlier) {
    if (!std::filesystem::exists(std::filesystem::symlink_status(file))) continue;
    if (!overwrite) {
      throw_file_error(folder, "holds " + file.lexically_relative(folder).string() +
                                   " already; name another folder, or set overwrite");
    }
    std::filesystem::remove(file);
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_OUTPUT_FOLDER_HPP
