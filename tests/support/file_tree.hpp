// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "support/test.hpp"

namespace dynfilter::testing {

/// Content of every file by its name.
using FileTree = std::map<std::filesystem::path, std::string>;

/// All files in a folder and its subfolders, hidden ones included. A link to a file has the content
/// of its target; links to folders are not followed.
inline FileTree file_tree(const std::filesystem::path& folder) {
  FileTree files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[entry.path().lexically_relative(folder)] = file_text(entry.path());
    }
  }
  return files;
}

/// All files but the hidden ones.
inline FileTree visible_tree(const std::filesystem::path& folder) {
  FileTree files;
  if (!std::filesystem::exists(folder)) return files;
  for (const auto& [name, text] : file_tree(folder)) {
    if (name.string().find(".dynfilter-") == std::string::npos) files[name] = text;
  }
  return files;
}

/// Names in `before` that are missing or different in `after`.
inline std::string changed_names(const FileTree& before, const FileTree& after) {
  std::string names;
  for (const auto& [name, text] : before) {
    const auto found = after.find(name);
    if (found == after.end() || found->second != text) names += name.string() + ' ';
  }
  return names;
}

}  // namespace dynfilter::testing
