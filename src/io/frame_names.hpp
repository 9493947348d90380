// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Names of images and masks: which image a mask is of, and at what time.

#pragma once

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dynfilter/detail/number_text.hpp"
#include "io/text_table.hpp"

namespace dynfilter::detail {

inline std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// Orders names as people do: a number in them counts by its value, so that 10 comes after 9.
inline bool is_before(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto number_at = [&](const std::string& name, std::size_t& at) {
    while (at < name.size() && name[at] == '0') ++at;
    const std::size_t begin = at;
    while (at < name.size() && is_digit(name[at])) ++at;
    return name.substr(begin, at - begin);
  };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const std::string x = number_at(a, i), y = number_at(b, j);
    if (x != y) return x.size() == y.size() ? x < y : x.size() < y.size();
  }
  return i == a.size() && j == b.size() ? a < b : i == a.size();
}

/// Tells whether a file is called like an image that OpenCV reads. O(extension).
inline bool is_image_name(const std::string& file) {
  const std::size_t dot = file.rfind('.');
  if (dot == std::string::npos || dot == 0 || file[dot - 1] == '/') return false;
  const std::string extension = lower_case(file.substr(dot, 6));
  for (const char* known :
       {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm", ".pbm"}) {
    if (extension == known) return true;
  }
  return false;
}

/// Returns the name of the image that a mask belongs to: without the extensions of either
/// (a.jpg.png, as COLMAP wants) and without the word mask before or after (a_mask.png).
inline std::string frame_stem(const std::filesystem::path& mask) {
  std::string stem = mask.stem().string();
  while (is_image_name(stem)) stem.resize(stem.rfind('.'));
  const std::string name = lower_case(stem);
  constexpr std::size_t length = 5;
  const auto is_word = [&](std::size_t begin, std::string_view word) {
    return name.size() > length && name.compare(begin, length, word) == 0;
  };
  for (const char* word : {"_mask", "-mask", ".mask"}) {
    if (is_word(name.size() - std::min(length, name.size()), word)) {
      return stem.substr(0, stem.size() - length);
    }
  }
  return is_word(0, "mask_") || is_word(0, "mask-") ? stem.substr(length) : stem;
}

/// Returns the time that a name spells, as in 1341846434.710184, seconds or nanoseconds.
inline std::optional<double> time_of_name(const std::string& stem) {
  const std::optional<double> time = parse_number(stem);
  if (!time || !is_time_in_seconds(seconds_of(*time))) return {};
  return seconds_of(*time);
}

/// Tells whether names number the frames and are no times: 000000, 000001, … or 1, 2, 3, …
inline bool are_numbers(const std::vector<std::string>& stems) {
  const auto is_whole = [](const std::string& stem) {
    return !stem.empty() && stem.find_first_not_of("0123456789") == std::string::npos;
  };
  if (stems.empty() || !std::all_of(stems.begin(), stems.end(), is_whole)) return false;
  double smallest = INFINITY, largest = 0;
  for (const std::string& stem : stems) {
    if (stem.size() > 1 && stem[0] == '0') return true;
    smallest = std::min(smallest, parse_number(stem).value_or(0));
    largest = std::max(largest, parse_number(stem).value_or(0));
  }
  return stems.size() > 2 && largest - smallest + 1 == static_cast<double>(stems.size());
}

}  // namespace dynfilter::detail
