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

/// The files and folders that a sub-command reads. They are identified on the disk, so that no
/// symbolic link or other name hides one.
class Inputs {
 public:
  /// Adds a file; ignores one that does not exist.
  void add(const std::filesystem::path& path);

  /// Adds a folder and the files in it.
  void add_folder(const std::filesystem::path& folder);

  bool contains(const std::filesystem::path& path) const;

 private:
  std::set<std::pair<dev_t, ino_t>> ids_;
};

/// Refuses an output folder before any work is done, if the writer would write into a folder that
/// is read, replace a file that is read, or replace anything that no earlier writer of its name
/// wrote. `names` are the names that the writer uses in the folder; one that ends in a slash is a
/// folder. Throws std::runtime_error that names the obstacle.
void require_harmless(const Inputs& inputs, const std::filesystem::path& out,
                      const std::string& writer, const std::vector<std::filesystem::path>& names,
                      bool overwrite);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_INPUTS_HPP
