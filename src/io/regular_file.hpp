// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Checks the kind of a file before opening it: opening a FIFO waits for a writer, which may never
// come.

#ifndef DYNFILTER_SRC_IO_REGULAR_FILE_HPP
#define DYNFILTER_SRC_IO_REGULAR_FILE_HPP

#include <filesystem>
#include <system_error>

#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Returns the type of file at a path and follows symbolic links. Throws std::runtime_error that
/// names a path that cannot be inspected.
inline std::filesystem::file_type type_of(const std::filesystem::path& path) {
  std::error_code failure;
  const std::filesystem::file_type type = std::filesystem::status(path, failure).type();
  if (type == std::filesystem::file_type::none) {
    throw_file_error(path, "cannot be read: " + failure.message());
  }
  return type;
}

/// Tells whether anything is at the path. Throws as type_of does.
inline bool exists(const std::filesystem::path& path) {
  return type_of(path) != std::filesystem::file_type::not_found;
}

/// Throws std::runtime_error that names the path if it is missing or is a folder, FIFO, device or
/// socket.
inline void require_regular_file(const std::filesystem::path& path) {
  const std::filesystem::file_type type = type_of(path);
  if (type == std::filesystem::file_type::not_found)
    throw_file_error(path, "there is no such file");
  if (type != std::filesystem::file_type::regular) {
    throw_file_error(path, "is not a regular file");
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_REGULAR_FILE_HPP
