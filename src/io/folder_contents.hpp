// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What lies in a folder of results.

#ifndef DYNFILTER_SRC_IO_FOLDER_CONTENTS_HPP
#define DYNFILTER_SRC_IO_FOLDER_CONTENTS_HPP

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "io/hidden_names.hpp"

namespace dynfilter::detail {

/// Returns the file system of a file; 0 if there is no such file.
inline dev_t device_of(const std::filesystem::path& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_dev : 0;
}

/// Lists the files in a folder, at any depth: sorted names relative to the folder.
inline std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_directory()) files.push_back(entry.path().lexically_relative(folder));
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Lists the files below a folder without the hidden files of writers.
inline std::vector<std::filesystem::path> visible_files_below(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files = files_below(folder);
  files.erase(std::remove_if(files.begin(), files.end(),
                             [](const auto& file) { return is_hidden_name(file.filename()); }),
              files.end());
  return files;
}

/// Tells whether a name is that of a file below a folder: neither absolute nor with "..".
inline bool stays_below(const std::filesystem::path& name) {
  return !name.empty() && !name.is_absolute() &&
         std::find(name.begin(), name.end(), "..") == name.end();
}

/// Tells whether the parent folder (existing or not) of a file below a folder is neither a link nor
/// on another file system.
inline bool has_own_parent(const std::filesystem::path& folder, const std::filesystem::path& name) {
  namespace fs = std::filesystem;
  for (fs::path part = name.parent_path(); !part.empty(); part = part.parent_path()) {
    const fs::file_status status = fs::symlink_status(folder / part);
    if (!fs::exists(status)) continue;
    if (!fs::is_directory(status) || device_of(folder / part) != device_of(folder)) return false;
  }
  return true;
}

/// Lists the folders above these files, below `folder`, that are not there: inner ones first.
inline std::vector<std::filesystem::path> missing_folders(
    const std::filesystem::path& folder, const std::vector<std::filesystem::path>& files) {
  std::vector<std::filesystem::path> missing;
  for (const std::filesystem::path& file : files) {
    for (auto part = file.parent_path(); !part.empty(); part = part.parent_path()) {
      const bool is_there = std::filesystem::exists(std::filesystem::symlink_status(folder / part));
      const bool is_known = std::find(missing.begin(), missing.end(), part) != missing.end();
      if (!is_there && !is_known) missing.push_back(part);
    }
  }
  std::sort(missing.rbegin(), missing.rend());
  return missing;
}

/// Removes the folders of these files if they are empty.
inline void remove_empty_folders(const std::filesystem::path& folder,
                                 const std::vector<std::filesystem::path>& files) {
  std::error_code not_empty;
  for (const std::filesystem::path& file : files) {
    for (auto part = file.parent_path(); !part.empty(); part = part.parent_path()) {
      std::filesystem::remove(folder / part, not_empty);
    }
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_FOLDER_CONTENTS_HPP
