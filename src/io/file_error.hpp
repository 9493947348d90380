// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace dynfilter::detail {

inline bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; }

/// Tells whether a name would break a list, or write to a terminal more than its letters.
inline bool has_control(const std::string& name) {
  return std::any_of(name.begin(), name.end(), is_control);
}

/// Returns a message with text of a file in it for people: a control character becomes '?', and
/// the middle of a long text is left out.
inline std::string shown(std::string text) {
  constexpr std::size_t begin = 700, end = 300;
  if (text.size() > begin + end) text.replace(begin, text.size() - begin - end, " ... ");
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

/// Throws for a file that is missing, malformed or cannot be written: "<path>: <what is wrong>", in
/// one line.
[[noreturn]] inline void throw_file_error(const std::filesystem::path& path,
                                          const std::string& what) {
  throw std::runtime_error(shown(path.string() + ": " + what));
}

/// Returns the type of file at a path and follows symbolic links. Throws std::runtime_error that
/// names a path that cannot be inspected.
inline std::filesystem::file_type type_of(const std::filesystem::path& path) {
  std::error_code failure;
  const std::filesystem::file_type type = std::filesystem::status(path, failure).type();
  if (type != std::filesystem::file_type::none) return type;
  throw_file_error(path, "cannot be read: " + failure.message());
}

/// Tells whether anything is at the path. Throws as type_of does.
inline bool exists(const std::filesystem::path& path) {
  return type_of(path) != std::filesystem::file_type::not_found;
}

/// Refuses a path that is missing or is a folder, FIFO, device or socket: opening a FIFO waits for
/// a writer, which may never come.
inline void require_regular_file(const std::filesystem::path& path) {
  const std::filesystem::file_type type = type_of(path);
  if (type == std::filesystem::file_type::regular) return;
  const bool is_there = type != std::filesystem::file_type::not_found;
  throw_file_error(path, is_there ? "is not a regular file" : "there is no such file");
}

/// Says what lies in place of an image or a model, by its first bytes; empty if that is unknown.
inline std::string in_place_of(std::string_view bytes) {
  const auto begins = [&](std::string_view with) { return bytes.substr(0, with.size()) == with; };
  if (begins("version https://git-lfs")) {
    return "is a pointer of Git LFS, not the file: run git lfs pull where it comes from";
  }
  const bool is_page = begins("<!DOCTYPE html") || begins("<!doctype html") || begins("<html");
  return is_page ? "is a web page, not the file: download it anew" : "";
}

}  // namespace dynfilter::detail
