// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tables in text files: row by row, with errors that name file and line.

#ifndef DYNFILTER_SRC_IO_TEXT_TABLE_HPP
#define DYNFILTER_SRC_IO_TEXT_TABLE_HPP

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Reads a table row by row. Skips blank lines, lines that start with '#' and a byte order mark,
/// and accepts CR LF. Columns are separated by blanks, or by `separator` if given. Every error is a
/// std::runtime_error that starts with "<path>:<line>: ".
class TableReader {
 public:
  explicit TableReader(std::filesystem::path path, char separator = ' ')
      : path_(std::move(path)), separator_(separator) {
    std::error_code ignored;
    if (!std::filesystem::exists(path_, ignored)) throw_file_error(path_, "there is no such file");
    stream_.open(path_, std::ios::binary);
    if (!stream_ || std::filesystem::is_directory(path_, ignored)) {
      throw_file_error(path_, "cannot be read");
    }
  }

  /// Moves on to the next row; false at the end of the file.
  bool next() {
    std::string text;
    while (std::getline(stream_, text)) {
      ++line_;
      if (line_ == 1 && text.compare(0, 3, "\xEF\xBB\xBF") == 0) text.erase(0, 3);
      split(text);
      const bool blank = cells_.empty() || (cells_.size() == 1 && cells_[0].empty());
      if (!blank && cells_[0][0] != '#') return true;
    }
    if (stream_.bad()) throw_file_error(path_, "cannot be read to its end");
    return false;
  }

  std::size_t line() const { return line_; }
  std::size_t columns() const { return cells_.size(); }
  const std::filesystem::path& path() const { return path_; }

  [[noreturn]] void fail(const std::string& what) const { fail_at(line_, what); }
  [[noreturn]] void fail_at(std::size_t line, const std::string& what) const {
    throw std::runtime_error(path_.string() + ":" + std::to_string(line) + ": " + what);
  }

  /// Refuses rows with fewer columns; `want` names the columns.
  void require_columns(std::size_t count, const char* want) const {
    if (columns() >= count) return;
    fail("got " + std::to_string(columns()) + " columns; want " + want);
  }

  const std::string& text(std::size_t column) const { return cells_[column]; }

  double number(std::size_t column, const char* name) const {
    const std::optional<double> value = parse_number(text(column));
    if (!value) fail(std::string(name) + ": got '" + text(column) + "'; want a finite number");
    return *value;
  }

  double time(std::size_t column) const {
    const double value = number(column, "time");
    if (!is_time_in_seconds(value)) fail("time: got '" + text(column) + "'; want seconds");
    return value;
  }

  int integer(std::size_t column, const char* name) const {
    const double value = parse_number(text(column)).value_or(0.5);  // 0.5 is not whole
    if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max()) {
      fail(std::string(name) + ": got '" + text(column) + "'; want a whole number");
    }
    return static_cast<int>(value);
  }

 private:
  static std::string trimmed(const std::string& text) {
    const std::size_t first = text.find_first_not_of(" \t\r");
    if (first == std::string::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t\r") + 1 - first);
  }

  void split(const std::string& line) {
    cells_.clear();
    const char* separators = separator_ == ' ' ? " \t" : &separator_;
    const std::size_t length = separator_ == ' ' ? 2 : 1;
    const std::string text = trimmed(line);
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t found = text.find_first_of(separators, begin, length);
      const std::size_t end = found == std::string::npos ? text.size() : found;
      if (separator_ != ' ' || end > begin)
        cells_.push_back(trimmed(text.substr(begin, end - begin)));
      begin = end + 1;
    }
  }

  std::filesystem::path path_;
  char separator_;
  std::ifstream stream_;
  std::size_t line_ = 0;
  std::vector<std::string> cells_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_TEXT_TABLE_HPP
