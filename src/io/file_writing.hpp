// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Writes all files: text, tables and images. Never follows a link, because the folder may be part
// of a downloaded data set. An error names the file and the cause.

#pragma once

#include <fcntl.h>
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

/// Opens a file that is no link, writes all bytes and closes it. The flag is O_EXCL for a new file
/// or O_APPEND. Returns false and sets errno on failure.
inline bool write_bytes(const std::filesystem::path& path, int flag, std::string_view bytes) {
  const int number = ::open(path.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC | flag, 0666);
  std::FILE* const file = number < 0 ? nullptr : ::fdopen(number, "wb");
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

/// Throws std::runtime_error for what is neither missing nor a regular file: writing to a link
/// would change another file, and opening a FIFO waits.
inline std::filesystem::file_status require_writable(const std::filesystem::path& path) {
  std::error_code ignored;
  const auto status = std::filesystem::symlink_status(path, ignored);
  if (std::filesystem::is_symlink(status)) {
    throw_file_error(path, "is a symbolic link, which is not followed; want a new or regular file");
  }
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status)) return status;
  throw_file_error(path, "is not a regular file");
}

/// Writes these bytes to a file, replacing an earlier one: writes a new hidden file beside it and
/// renames that. Keeps the permissions of the earlier one. Throws std::runtime_error that names the
/// file, as for a link; an earlier file is untouched then.
inline void write_file(const std::filesystem::path& path, std::string_view bytes) {
  namespace fs = std::filesystem;
  static std::atomic<unsigned> count{0};
  const fs::file_status status = require_writable(path);
  const std::string name = std::string(hidden_prefix) + "part-" + std::to_string(::getpid()) + '-';
  fs::path part;
  bool is_written = false;
  do {
    part = path.parent_path() / (name + std::to_string(count++));
    is_written = write_bytes(part, O_EXCL, bytes);
  } while (!is_written && errno == EEXIST);
  std::error_code ignored;
  if (is_written) {
    if (fs::exists(status)) fs::permissions(part, status.permissions(), ignored);
    if (std::rename(part.c_str(), path.c_str()) == 0) return;
  }
  const int failure = errno;
  fs::remove(part, ignored);
  errno = failure;
  throw_write_error(path);
}

/// Adds a piece of text to a file, or makes it. After an error the file is as long as before, and
/// the next piece may succeed. Throws std::runtime_error that names the file, as for a link.
inline void append_to_file(const std::filesystem::path& path, std::string_view text) {
  require_writable(path);
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  if (write_bytes(path, O_APPEND, text)) return;
  const int failure = errno;
  if (size != static_cast<std::uintmax_t>(-1)) std::filesystem::resize_file(path, size, ignored);
  errno = failure;
  throw_write_error(path);
}

}  // namespace dynfilter::detail
