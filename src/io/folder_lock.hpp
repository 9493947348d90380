// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_IO_FOLDER_LOCK_HPP
#define DYNFILTER_SRC_IO_FOLDER_LOCK_HPP

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <filesystem>
#include <string>

#include "io/descriptor.hpp"
#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Keeps a second writer of the same kind, in this process or another, out of a folder while it
/// lives. Where the file system knows no locks, it keeps nobody out.
class FolderLock {
 public:
  /// Throws std::runtime_error that names the folder if another writer is there.
  FolderLock(const std::filesystem::path& folder, const std::string& writer)
      : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (::flock(folder_.number(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
    throw_file_error(folder, "another dynfilter " + writer + " is writing there");
  }

 private:
  Descriptor folder_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_FOLDER_LOCK_HPP
