// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TOOLS_OUTPUT_FILE_HPP
#define DYNFILTER_TOOLS_OUTPUT_FILE_HPP

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace dynfilter::tools {

/// A text file that says so when it could not be written.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path) : path_(path), stream_(path) {}

  template <class Value>
  OutputFile& operator<<(const Value& value) {
    stream_ << value;
    return *this;
  }

  void close() {
    stream_.close();
    if (!stream_) throw std::runtime_error(path_.string() + ": cannot be written");
  }

 private:
  std::filesystem::path path_;
  std::ofstream stream_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_TOOLS_OUTPUT_FILE_HPP
