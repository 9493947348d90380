// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "io/file_writing.hpp"
#include "support/expect_error.hpp"
#include "support/file_size_limit.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::file_text;
using testing::TemporaryFolder;

TEST(WriteFile, ReplacesAFileAndKeepsItsPermissions) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("file", "old");
  const fs::perms own = fs::perms::owner_read | fs::perms::owner_write;
  fs::permissions(file, own);
  write_file(file, "new");
  EXPECT_EQ(file_text(file), "new");
  EXPECT_EQ(fs::status(file).permissions(), own);
  {
    const testing::FileSizeLimit limit(1);
    expect_error<std::runtime_error>([&] { write_file(file, "newer"); },
                                     "file: cannot be written: File too large");
  }
  EXPECT_EQ(file_text(file), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(WriteFile, FollowsLinks) {
  const TemporaryFolder folder;
  folder.write("target", "old");
  fs::create_symlink("target", folder / "link");
  fs::create_symlink("made", folder / "dangling");
  write_file(folder / "link", "new");
  write_file(folder / "dangling", "new");
  for (const char* name : {"target", "made"}) EXPECT_EQ(file_text(folder / name), "new");
  for (const char* name : {"link", "dangling"}) EXPECT_TRUE(fs::is_symlink(folder / name));
}

TEST(WriteFile, WritesToADeviceAndRefusesAFolder) {
  EXPECT_NO_THROW(write_file("/dev/null", "text"));
  expect_error<std::runtime_error>([] { write_file("/dev/full", "text"); },
                                   "/dev/full: cannot be written: No space left");
  const TemporaryFolder folder;
  expect_error<std::runtime_error>([&] { write_file(folder.path(), "text"); },
                                   folder.path().string() + ": cannot be written: Is a directory");
}

TEST(AppendToFile, AddsAPieceOrNothing) {
  const TemporaryFolder folder;
  append_to_file(folder / "file", "one\n");
  {
    const testing::FileSizeLimit limit(6);
    expect_error<std::runtime_error>([&] { append_to_file(folder / "file", "two\n"); },
                                     "file: cannot be written: File too large");
  }
  append_to_file(folder / "file", "three\n");
  EXPECT_EQ(file_text(folder / "file"), "one\nthree\n");
}

}  // namespace
}  // namespace dynfilter::detail
