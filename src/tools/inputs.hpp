// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a sub-command reads, and which results may be replaced. A single file begins with a sentence
// that names the sub-command that wrote it.

#ifndef DYNFILTER_SRC_TOOLS_INPUTS_HPP
#define DYNFILTER_SRC_TOOLS_INPUTS_HPP

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <system_error>

#include <nlohmann/json.hpp>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"
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

  bool contains(const std::filesystem::path& file) const {
    return files_.count(detail::canonical_folder(file)) > 0;
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

/// Refuses a file in a folder that is missing or read-only, and an existing file that does not
/// begin like this. An empty file may be replaced.
inline void require_replaceable(const std::filesystem::path& file, const std::string& beginning) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) {
    detail::throw_file_error(file, "cannot be written: it is a folder");
  }
  const bool exists = fs::exists(file, ignored);
  const fs::path folder = fs::absolute(file).parent_path();
  if (!exists && ::access(folder.c_str(), W_OK) != 0) detail::throw_write_error(file);
  if (!fs::is_regular_file(file, ignored) || fs::file_size(file) == 0) return;
  std::string text(beginning.size(), '\0');
  std::ifstream(file, std::ios::binary).read(text.data(), std::streamsize(text.size()));
  if (text == beginning) return;
  detail::throw_file_error(file,
                           "exists, and this sub-command did not write it; name another file");
}

/// Returns how a JSON file of a sub-command begins.
inline std::string json_beginning(const std::string& command) {
  return "{\n  \"written_by\": \"dynfilter " + command + "\",\n";
}

/// Writes a JSON object, which must not be empty, with the member `written_by` before its own.
inline void write_json(const std::filesystem::path& file, const std::string& command,
                       const nlohmann::ordered_json& json) {
  using Json = nlohmann::ordered_json;
  require_replaceable(file, json_beginning(command));
  const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace);
  detail::write_file(file, json_beginning(command) + text.substr(2) + '\n');
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_INPUTS_HPP
