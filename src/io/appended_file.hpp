// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_IO_APPENDED_FILE_HPP
#define DYNFILTER_SRC_IO_APPENDED_FILE_HPP

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string_view>
#include <utility>

#include "io/descriptor.hpp"
#include "io/file_error.hpp"
#include "io/file_writing.hpp"

namespace dynfilter::detail {

/// A file that grows by whole pieces of text: after an error it is as long as before, and the next
/// piece may succeed.
class AppendedFile {
 public:
  /// Opens a file, or makes it. Throws std::runtime_error that names it.
  explicit AppendedFile(std::filesystem::path path)
      : path_(std::move(path)),
        file_(::open(path_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666)),
        size_(file_.number() < 0 ? -1 : ::lseek(file_.number(), 0, SEEK_END)) {
    if (size_ < 0) fail();
  }

  /// Adds a piece. Throws std::runtime_error that names the file. Allocates nothing if all is well.
  void append(std::string_view text) {
    if (has_part_) cut();  // of an earlier piece
    if (has_part_) fail();
    if (write_all(file_.number(), text)) {
      size_ += static_cast<off_t>(text.size());
      return;
    }
    const int failure = errno;
    cut();
    errno = failure;
    fail();
  }

 private:
  /// Shortens the file to the whole pieces.
  void cut() { has_part_ = ::ftruncate(file_.number(), size_) != 0; }

  [[noreturn]] void fail() const { throw_file_error(path_, "cannot be written: " + errno_text()); }

  std::filesystem::path path_;
  Descriptor file_;
  off_t size_;
  bool has_part_ = false;  // of a piece, at the file's end
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_APPENDED_FILE_HPP
