// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Files that grow by whole pieces, and the lock of a folder.

#include "io/appended_file.hpp"

#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "io/folder_lock.hpp"
#include "support/expect_error.hpp"
#include "support/file_size_limit.hpp"
#include "support/temporary_folder.hpp"

namespace {
bool can_cut = true;
}

// Replaces the C library's function.
extern "C" int ftruncate(int file, off_t size) noexcept {
  if (can_cut) return ::truncate(("/proc/self/fd/" + std::to_string(file)).c_str(), size);
  errno = EIO;
  return -1;
}

namespace dynfilter::detail {
namespace {

using testing::expect_error;
using testing::file_text;
using testing::FileSizeLimit;
using testing::TemporaryFolder;

TEST(AppendedFile, GrowsByWholePieces) {
  const TemporaryFolder folder;
  folder.write("file", "begin ");
  AppendedFile file(folder / "file");
  {
    const FileSizeLimit limit(8);
    expect_error<std::runtime_error>([&] { file.append("piece "); }, "file: cannot be written");
  }
  EXPECT_EQ(file_text(folder / "file"), "begin ");
  file.append("piece ");
  file.append("end");
  EXPECT_EQ(file_text(folder / "file"), "begin piece end");
}

TEST(AppendedFile, CutsOffLaterWhatItCannotCutOffNow) {
  const TemporaryFolder folder;
  AppendedFile file(folder / "file");
  can_cut = false;
  {
    const FileSizeLimit limit(3);
    expect_error<std::runtime_error>([&] { file.append("piece"); }, "File too large");
  }
  expect_error<std::runtime_error>([&] { file.append("piece"); }, "Input/output error");
  EXPECT_EQ(file_text(folder / "file"), "pie");
  can_cut = true;
  file.append("whole");
  EXPECT_EQ(file_text(folder / "file"), "whole");
}

TEST(AppendedFile, NamesAFileThatCannotBeMade) {
  const TemporaryFolder folder;
  expect_error<std::runtime_error>([&] { AppendedFile{folder / "no/file"}; },
                                   "no/file: cannot be written: No such file");
}

TEST(FolderLock, KeepsASecondWriterOutAndEndsWithTheFirst) {
  const TemporaryFolder folder;
  {
    const FolderLock first(folder.path(), "test");
    expect_error<std::runtime_error>([&] { FolderLock(folder.path(), "test"); },
                                     "another dynfilter test is writing there");
  }
  EXPECT_NO_THROW(FolderLock(folder.path(), "test"));
}

TEST(FolderLock, KeepsNobodyOutWhereNothingCanBeLocked) {
  const TemporaryFolder folder;
  EXPECT_NO_THROW(FolderLock(folder / "none", "test"));
}

}  // namespace
}  // namespace dynfilter::detail
