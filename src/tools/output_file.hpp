// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP
#define DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP

#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "io/file_error.hpp"
#include "io/file_writing.hpp"

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

/// The part of a file that is searched for the mark of its kind.
constexpr std::size_t kind_bytes = 1000;

/// Refuses a file in a folder that is missing or read-only, and an existing file of another kind: a
/// sub-command replaces only files with `mark` near
/// their beginning, which it wrote itself. An empty file may be replaced.
inline void require_replaceable(const std::filesystem::path& file, const std::string& mark) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    detail::throw_file_error(file, "cannot be written: it is a folder");
  }
  const auto folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::exists(file, ignored) && ::access(folder.c_str(), W_OK) != 0) {
    detail::throw_file_error(file, "cannot be written: " + detail::errno_text());
  }
  if (!std::filesystem::is_regular_file(file, ignored)) return;
  std::array<char, kind_bytes> bytes{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), bytes.size());
  const std::string beginning(bytes.data(), static_cast<std::size_t>(stream.gcount()));
  if (stream.eof() && beginning.empty()) return;
  if (beginning.find(mark) != std::string::npos) return;
  detail::throw_file_error(file, "exists and is not a file of this kind; name another file");
}

/// Writes a text of this kind, unless it would replace a file of another kind.
inline void write_replaceable(const std::filesystem::path& file, const std::string& mark,
                              const std::string& text) {
  if (text.substr(0, kind_bytes).find(mark) == std::string::npos) {
    throw std::logic_error(file.string() + ": could not be recognised later, because it lacks " +
                           mark);
  }
  require_replaceable(file, mark);
  detail::write_file(file, text);
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_OUTPUT_FILE_HPP
