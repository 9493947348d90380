// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_INPUTS_HPP
#define DYNFILTER_SRC_TOOLS_INPUTS_HPP

#include <sys/types.h>

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace dynfilter::tools {

/// The files and folders that a sub-command reads. They are known by what they are on the disk, so
/// that a symbolic link or another name hides none.
class Inputs {
 public:
  /// Nothing where there is no such file.
  void add(const std::filesystem::path& path);

  /// A folder and the files in it.
  void add_folder(const std::filesystem::path& folder);

  bool contains(const std::filesystem::path& path) const;

 private:
  std::set<std::pair<dev_t, ino_t>> ids_;
};

/// Refuses, before any work is done, an output folder in which a writer would write into a folder
/// that is read, replace a file that is read, or replace what no earlier writer of that name wrote.
/// `names` are those that it takes in the folder; one that ends in a slash is a folder's. Throws
/// std::runtime_error that names what is in the way.
void require_harmless(const Inputs& inputs, const std::filesystem::path& out,
                      const std::string& writer, const std::vector<std::filesystem::path>& names,
                      bool overwrite);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_INPUTS_HPP
