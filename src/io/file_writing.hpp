// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Writes all files: text, tables, images and pages. A file appears whole or not at all, and an
// error names it and the cause.

#ifndef DYNFILTER_SRC_IO_FILE_WRITING_HPP
#define DYNFILTER_SRC_IO_FILE_WRITING_HPP

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Returns the message for `errno`.
inline std::string errno_text() { return std::generic_category().message(errno); }

/// Writes all bytes. Returns false and sets errno on failure.
inline bool write_all(int file, std::string_view bytes) {
  constexpr std::size_t max_bytes_a_call = std::size_t{1} << 30;
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), std::min(bytes.size(), max_bytes_a_call));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Writes all bytes and closes the file. Returns false and sets errno on failure.
inline bool write_and_close(int file, std::string_view bytes) {
  if (write_all(file, bytes)) return ::close(file) == 0;
  const int failure = errno;
  ::close(file);
  errno = failure;
  return false;
}

/// Makes a file with a fresh name in this folder. Returns its descriptor, or -1.
inline int make_part_file(const std::filesystem::path& folder, std::filesystem::path& part) {
  for (int number = 0;; ++number) {
    part =
        folder / (".dynfilter-part-" + std::to_string(::getpid()) + "-" + std::to_string(number));
    const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0 || errno != EEXIST) return file;
  }
}

/// Follows symbolic links, also to a file that is not there yet. Throws std::runtime_error for
/// links in a circle.
inline std::filesystem::path target_of(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  constexpr int max_links = 40;  // the kernel's own limit
  fs::path target = path;
  std::error_code ignored;  // such a path cannot be written either, and that error says more
  for (int k = 0; fs::is_symlink(fs::symlink_status(target, ignored)); ++k) {
    if (k == max_links) throw_file_error(path, "cannot be written: too many symbolic links");
    target = target.parent_path() / fs::read_symlink(target);  // an absolute one is taken as it is
  }
  return target;
}

/// Writes these bytes to a file, replacing an earlier one: writes a hidden file beside it and
/// renames that. Keeps the permissions of the earlier one. Replaces the target of a symbolic link,
/// not the link. Writes directly to a pipe or a device. Throws std::runtime_error that names the
/// file, and the hidden one if it could not be removed; an earlier file is untouched then.
inline void write_file(const std::filesystem::path& path, std::string_view bytes) {
  namespace fs = std::filesystem;
  const auto fail = [&](const std::string& left = {}) {
    throw_file_error(path, "cannot be written: " + errno_text() + left);
  };
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0 || !write_and_close(file, bytes)) fail();
    return;
  }
  const fs::path target = target_of(path);
  fs::path part;
  const int file = make_part_file(target.parent_path(), part);
  if (file < 0) fail();
  if (fs::is_regular_file(status)) ::fchmod(file, static_cast<mode_t>(status.permissions()));
  if (write_and_close(file, bytes) && std::rename(part.c_str(), target.c_str()) == 0) return;
  const int failure = errno;
  const bool is_left = ::unlink(part.c_str()) != 0;
  errno = failure;
  fail(is_left ? "; remove what was written so far, " + part.string() : "");
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_FILE_WRITING_HPP
