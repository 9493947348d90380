// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP
#define DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP

#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/fingerprint.hpp"

namespace dynfilter::tools {

/// A text file that appears whole on `close`, or not at all. `close` throws std::runtime_error that
/// names the file if it cannot be written.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path) : path_(std::move(path)) {
    text_.exceptions(std::ios::badbit);  // a stream would swallow a failed allocation
  }

  template <class Value>
  OutputFile& operator<<(const Value& value) {
    text_ << value;
    return *this;
  }

  std::string text() const { return text_.str(); }

  void close() const { detail::write_file(path_, text()); }

 private:
  std::filesystem::path path_;
  std::ostringstream text_;
};

/// Tells whether a text is `beginning`, a checksum of the other bytes, and a rest: as
/// write_replaceable wrote it, and unchanged since.
inline bool is_unchanged(std::string_view text, std::string_view beginning) {
  constexpr std::size_t digits = 16;
  if (text.substr(0, beginning.size()) != beginning) return false;
  const std::string_view sealed = text.substr(beginning.size());
  const auto checksum = detail::parse_hash(std::string(sealed.substr(0, digits)));
  if (!checksum) return false;
  detail::Fingerprint others = detail::fingerprint_of(beginning);
  others.add(sealed.substr(digits));
  return *checksum == others.hash;
}

/// Refuses a file in a folder that is missing or read-only, and an existing file that is not as
/// write_replaceable wrote it with this beginning. An empty file may be replaced.
inline void require_replaceable(const std::filesystem::path& file, std::string_view beginning) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    detail::throw_file_error(file, "cannot be written: it is a folder");
  }
  const auto folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::exists(file, ignored) && ::access(folder.c_str(), W_OK) != 0) {
    detail::throw_file_error(file, "cannot be written: " + detail::errno_text());
  }
  if (!std::filesystem::is_regular_file(file, ignored)) return;
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  if (stream && (text.empty() || is_unchanged(text, beginning))) return;
  detail::throw_file_error(file,
                           "exists, and is not as this sub-command wrote it; name another file");
}

/// Writes `beginning`, a checksum of the other bytes, and the rest. Refuses to replace any other
/// file than an unchanged one of this beginning.
inline void write_replaceable(const std::filesystem::path& file, std::string_view beginning,
                              std::string_view rest) {
  require_replaceable(file, beginning);
  detail::Fingerprint others = detail::fingerprint_of(beginning);
  others.add(rest);
  std::string text(beginning);
  text += detail::hash_text(others.hash);
  text += rest;
  detail::write_file(file, text);
}

/// Returns how a JSON file of a sub-command begins, see write_replaceable.
inline std::string json_beginning(const std::string& command) {
  return "{\n  \"written_by\": \"dynfilter " + command + "\",\n  \"checksum\": \"";
}

/// Writes a JSON object, which must not be empty, with the members `written_by` and `checksum`
/// before its own.
inline void write_replaceable_json(const std::filesystem::path& file, const std::string& command,
                                   const nlohmann::ordered_json& json) {
  using Json = nlohmann::ordered_json;
  const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace);
  write_replaceable(file, json_beginning(command), "\"," + text.substr(1) + '\n');
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP
