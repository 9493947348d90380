// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "io/file_error.hpp"
#include "io/staged_folder.hpp"

namespace dynfilter::tools {

/// The files and folders that a sub-command reads, by their canonical paths.
class Inputs {
 public:
  /// Adds a file, or a folder beside whose read files results may lie; ignores a missing one.
  void add(const std::filesystem::path& path) {
    if (!path.empty() && std::filesystem::exists(path))
      files_.insert(detail::canonical_folder(path));
  }

  /// Adds a folder in which no results may lie.
  void add_folder(const std::filesystem::path& folder) {
    if (std::filesystem::is_directory(folder)) folders_.insert(detail::canonical_folder(folder));
  }

  /// Refuses an output folder before any work is done: one that is read from, that lies in a folder
  /// that is, that holds something that is read, or that holds files which no earlier writer of
  /// this name wrote. Throws std::runtime_error that names the obstacle.
  void require_harmless(const std::filesystem::path& out, const std::string& writer,
                        bool overwrite) const {
    const std::filesystem::path folder = detail::canonical_folder(out);
    const auto refuse_if = [&](bool is_within, const std::filesystem::path& read) {
      if (!is_within) return;
      detail::throw_file_error(out, read.string() +
                                        " is read; name another --out folder, which "
                                        "neither holds it nor lies in it");
    };
    for (const auto& read : files_) refuse_if(detail::is_within(read, folder), read);
    for (const auto& read : folders_) {
      refuse_if(detail::is_within(read, folder) || detail::is_within(folder, read), read);
    }
    detail::WrittenFiles(folder, writer).require_room(overwrite);
  }

 private:
  std::set<std::filesystem::path> files_, folders_;
};

}  // namespace dynfilter::tools
