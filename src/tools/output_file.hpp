// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Single files that a sub-command writes. They begin with a sentence that names it, so that it
// replaces no other files.

#ifndef DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP
#define DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include <nlohmann/json.hpp>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"

namespace dynfilter::tools {

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

#endif  // DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP
