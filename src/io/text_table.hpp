// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tables in text files: row by row, with errors that name file and line.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Returns a number as seconds: nanoseconds, as EuRoC, KITTI-360 and ROS write them, are divided.
/// No time in seconds or microseconds is as large.
inline double seconds_of(double time) { return time >= 1e17 ? time / 1e9 : time; }

/// Tells whether times, in order, are so far apart that they are no seconds: nanoseconds or
/// microseconds that begin at 0, as simulators write them.
inline bool are_too_far_apart(const std::vector<double>& times) {
  constexpr double max_gap_s = 3600;
  if (times.size() < 3) return false;
  std::vector<double> gaps;
  for (std::size_t i = 1; i < times.size(); ++i) gaps.push_back(std::abs(times[i] - times[i - 1]));
  return quantile_of(gaps) > max_gap_s;
}

constexpr const char* far_apart_text = "its times are hours apart: nanoseconds? want seconds";

/// Returns the text as UTF-8 with LF at the ends of its lines, from UTF-16 with a byte order mark
/// (a shell's `>` on Windows) and from CR LF or CR. Characters beyond ASCII become '?'.
inline std::string plain_text(const std::string& bytes) {
  std::string text = bytes.compare(0, 3, "\xEF\xBB\xBF") == 0 ? bytes.substr(3) : bytes;
  const bool is_little = bytes.compare(0, 2, "\xFF\xFE") == 0;
  if (is_little || bytes.compare(0, 2, "\xFE\xFF") == 0) {
    text.clear();
    for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
      const char low = bytes[is_little ? i : i + 1];
      const char high = bytes[is_little ? i + 1 : i];
      text += high == 0 && (low & 0x80) == 0 ? low : '?';
    }
  }
  std::size_t length = 0;
  char previous = 0;
  for (const char c : text) {
    if (c != '\n' || previous != '\r') text[length++] = c == '\r' ? '\n' : c;
    previous = c;
  }
  text.resize(length);
  return text;
}

/// Reads a table row by row, in any encoding and with any ends of lines that plain_text knows.
/// Skips blank lines and lines that start with '#'. The first of the separators that divides a row
/// into columns counts. Every error is a std::runtime_error that starts with "<path>:<line>: ".
class TableReader {
 public:
  explicit TableReader(std::filesystem::path path, std::string separators = ";, ")
      : path_(std::move(path)), separators_(std::move(separators)) {
    std::error_code ignored;
    if (!std::filesystem::exists(path_, ignored)) throw_file_error(path_, "there is no such file");
    std::ifstream file(path_, std::ios::binary);
    if (!file || std::filesystem::is_directory(path_, ignored)) {
      throw_file_error(path_, "cannot be read");
    }
    const std::string bytes(std::istreambuf_iterator<char>(file), {});
    if (file.bad()) throw_file_error(path_, "cannot be read to its end");
    const std::string text = plain_text(bytes);
    if (text.find('\0') != std::string::npos) {
      throw_file_error(path_, "holds zero bytes: UTF-16 without a byte order mark, or no text");
    }
    stream_.exceptions(std::ios::badbit);  // a stream would swallow a failed allocation
    stream_.str(text);
  }

  /// Moves on to the next row; false at the end of the file.
  bool next() {
    std::string text;
    while (std::getline(stream_, text)) {
      ++line_;
      split(text);
      const bool blank = cells_.empty() || (cells_.size() == 1 && cells_[0].empty());
      if (!blank && cells_[0][0] != '#') return true;
    }
    return false;
  }

  std::size_t line() const { return line_; }
  std::size_t columns() const { return cells_.size(); }
  /// Whether commas or the like divide the row, not blanks.
  bool has_separator() const { return has_separator_; }
  const std::filesystem::path& path() const { return path_; }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(shown(path_.string() + ":" + std::to_string(line_) + ": " + what));
  }

  /// Refuses rows with fewer columns; `want` names the columns.
  void require_columns(std::size_t count, const char* want) const {
    if (columns() >= count) return;
    fail("got " + std::to_string(columns()) + " columns; want " + want);
  }

  const std::string& text(std::size_t column) const { return cells_[column]; }

  double number(std::size_t column, const char* name) const {
    const std::optional<double> value = parse_number(text(column));
    if (value) return *value;
    const bool has_comma = text(column).find(',') != std::string::npos;
    fail(std::string(name) + ": got '" + text(column) + "'; want a finite number" +
         (has_comma ? ", with a decimal point" : ""));
  }

  double time(std::size_t column) const {
    const double value = seconds_of(number(column, "time"));
    if (value >= 1e6 && is_too_coarse(text(column))) {
      fail("time: '" + text(column) +
           "' has too few digits to tell frames apart; write "
           "milliseconds at least, in Python by '%.6f', as 1341846434.710184");
    }
    if (is_time_in_seconds(value)) return value;
    const char* unit = value >= 1e14 ? ", not microseconds" : ", not milliseconds";
    fail("time: got '" + text(column) + "'; want seconds" + (value > 0 ? unit : ""));
  }

  int integer(std::size_t column, const char* name, int min_value = std::numeric_limits<int>::min(),
              int max_value = std::numeric_limits<int>::max()) const {
    const double value = parse_number(text(column)).value_or(0.5);  // 0.5 is not whole
    const bool is_inside = value >= min_value && value <= max_value;
    if (is_inside && value == std::floor(value)) return static_cast<int>(value);
    fail(std::string(name) + ": got '" + text(column) + "'; want a whole number from " +
         std::to_string(min_value) + " to " + std::to_string(max_value));
  }

 private:
  /// Tells whether a large number with an exponent lacks digits: 1.30503e+09 is exact to 10 s.
  static bool is_too_coarse(const std::string& text) {
    constexpr std::size_t enough = 13;  // of a time since 1970, to milliseconds
    const std::size_t exponent = text.find_first_of("eE");
    return exponent < enough;
  }

  static std::string trimmed(const std::string& text) {
    const std::size_t first = text.find_first_not_of(" \t\r");
    if (first == std::string::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t\r") + 1 - first);
  }

  void split(const std::string& line) {
    for (const char separator : separators_) {
      const bool is_last = separator == separators_.back();
      if (!is_last && line.find(separator) == std::string::npos) continue;
      separate(line, separator);
      has_separator_ = separator != ' ';
      // "0,5 1,2" has decimal commas, and "1.5 a,b.png" a name with one.
      const auto has_blank = [](const std::string& cell) {
        return cell.find_first_of(" \t") != std::string::npos;
      };
      if (is_last || std::none_of(cells_.begin(), cells_.end(), has_blank)) return;
    }
  }

  void separate(const std::string& line, char separator) {
    cells_.clear();
    const std::string separators = separator == ' ' ? " \t" : std::string(1, separator);
    const std::string text = trimmed(line);
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
      if (separator != ' ' || end > begin) {
        cells_.push_back(trimmed(text.substr(begin, end - begin)));
      }
      begin = end + 1;
    }
  }

  std::filesystem::path path_;
  std::string separators_;
  bool has_separator_ = false;  // of the current row
  std::istringstream stream_;
  std::size_t line_ = 0;
  std::vector<std::string> cells_;
};

}  // namespace dynfilter::detail
