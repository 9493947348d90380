// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Writes all files: text, tables, images and pages. An error names the file and the cause.

#pragma once

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Names of the files and folders that dynfilter keeps in a folder of results begin like this.
constexpr const char* hidden_prefix = ".dynfilter-";

/// Opens a file in this mode of std::fopen, writes all bytes and closes it. Returns false and sets
/// errno on failure.
inline bool write_bytes(const std::filesystem::path& path, const char* mode,
                        std::string_view bytes) {
  std::FILE* const file = std::fopen(path.c_str(), mode);
  if (file == nullptr) return false;
  const bool is_written =
      std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size() && std::fflush(file) == 0;
  const int failure = errno;
  const bool is_closed = std::fclose(file) == 0;
  if (!is_written) errno = failure;
  return is_written && is_closed;
}

/// Throws for a file of which errno tells why it cannot be written.
[[noreturn]] inline void throw_write_error(const std::filesystem::path& path) {
  throw_file_error(path, "cannot be written: " + std::generic_category().message(errno));
}

/// Writes these bytes to a file, replacing an earlier one: writes a hidden file beside it and
/// renames that. Keeps the permissions of the earlier one. Follows symbolic links. Writes directly
/// to a pipe or a device. Throws std::runtime_error that names the file; an earlier file is
/// untouched then.
inline void write_file(const std::filesystem::path& path, std::string_view bytes) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  const bool is_dangling = !fs::exists(status) && fs::is_symlink(fs::symlink_status(path, ignored));
  if (is_dangling || (fs::exists(status) && !fs::is_regular_file(status))) {
    if (!write_bytes(path, "wbe", bytes)) throw_write_error(path);
    return;
  }
  static std::atomic<unsigned> count{0};
  const fs::path target = fs::exists(status) ? fs::canonical(path, ignored) : path;
  const fs::path part =
      target.parent_path() / (std::string(hidden_prefix) + "part-" + std::to_string(::getpid()) +
                              '-' + std::to_string(count++));
  if (write_bytes(part, "wbe", bytes)) {
    if (fs::exists(status)) fs::permissions(part, status.permissions(), ignored);
    if (std::rename(part.c_str(), target.c_str()) == 0) return;
  }
  const int failure = errno;
  fs::remove(part, ignored);
  errno = failure;
  throw_write_error(path);
}

/// Adds a piece of text to a file, or makes it. After an error the file is as long as before, and
/// the next piece may succeed. Throws std::runtime_error that names the file.
inline void append_to_file(const std::filesystem::path& path, std::string_view text) {
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  if (write_bytes(path, "abe", text)) return;
  const int failure = errno;
  if (size != static_cast<std::uintmax_t>(-1)) std::filesystem::resize_file(path, size, ignored);
  errno = failure;
  throw_write_error(path);
}

}  // namespace dynfilter::detail
