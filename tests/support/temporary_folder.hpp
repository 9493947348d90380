// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <system_error>

namespace dynfilter::testing {

/// Temporary folder of a test, removed with its content.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::random_device random;
    do {
      path_ = std::filesystem::temp_directory_path() /
              ("dynfilter_test_" + std::to_string(random()) + std::to_string(random()));
    } while (!std::filesystem::create_directories(path_));
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& file) const { return path_ / file; }

  /// Writes a file, creates its parent folders, and returns its path.
  std::filesystem::path write(const std::filesystem::path& file, const std::string& text) const {
    const std::filesystem::path target = path_ / file;
    std::filesystem::create_directories(target.parent_path());
    std::ofstream stream(target, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error("cannot write " + target.string());
    return target;
  }

 private:
  std::filesystem::path path_;
};

inline std::string file_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

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
