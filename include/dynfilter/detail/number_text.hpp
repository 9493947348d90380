// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Conversion between numbers and text, independent of the process's locale: a decimal comma in the
// host's program must not change files. (std::from_chars for double needs g++ 11.)

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>
#include <cstdint>
#include <ios>
#include <locale>
#include <optional>
#include <sstream>
#include <string>

namespace dynfilter::detail {

/// Returns the finite number that the whole of `text` spells in decimal notation.
inline std::optional<double> parse_number(const std::string& text) {
  if (text.find_first_of(" \t\n\v\f\r") != std::string::npos) return {};
  std::istringstream stream(text);
  stream.exceptions(std::ios::badbit);  // a stream would swallow a failed allocation
  stream.imbue(std::locale::classic());
  double value = 0;
  stream >> value;
  const bool whole = !stream.fail() && stream.peek() == std::istringstream::traits_type::eof();
  if (!whole || !std::isfinite(value)) return {};
  return value;
}

/// Formats a number with a fixed number of decimals, such as 1341846434.710184.
inline std::string fixed_decimals(double value, int decimals) {
  std::ostringstream stream;
  stream.exceptions(std::ios::badbit);  // a stream would swallow a failed allocation
  stream.imbue(std::locale::classic());
  stream.setf(std::ios::fixed);
  stream.precision(decimals);
  stream << value;
  return stream.str();
}

/// Helpers for times, which have 6 decimals in these formats. A double near 1.4e9 s is exact only
/// to 2e-7 s, so times are compared in whole microseconds: ties and limits then match the digits.
inline bool is_time_in_seconds(double value) { return std::abs(value) < 9e9; }  // false for NaN
inline std::int64_t microseconds(double time_s) { return std::llround(time_s * 1e6); }
inline std::string time_text(double time_s) { return fixed_decimals(time_s, 6); }

}  // namespace dynfilter::detail
