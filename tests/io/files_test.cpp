// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Files are written whole or not at all; what writers know of the files in a folder.

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "io/descriptor.hpp"
#include "io/file_writing.hpp"
#include "io/fingerprint.hpp"
#include "io/output_folder.hpp"
#include "io/staged_folder.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::file_text;
using testing::TemporaryFolder;

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(Descriptor, ClosesAnyNumber) {
  const int input = ::dup(0);
  ::close(0);
  {
    Descriptor moved(-1);
    Descriptor file(::open("/dev/null", O_RDONLY));
    EXPECT_EQ(file.number(), 0) << "the smallest that is free";
    moved = std::move(file);
    EXPECT_EQ(moved.number(), 0);
  }
  EXPECT_EQ(::fcntl(0, F_GETFD), -1);
  ::dup2(input, 0);
  ::close(input);
}

TEST(WriteFile, ReplacesTheTargetOfALink) {
  const TemporaryFolder folder;
  folder.write("target", "old");
  fs::create_symlink(folder / "target", folder / "link");
  write_file(folder / "link", "new");
  EXPECT_EQ(file_text(folder / "target"), "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(entries(folder.path()), 2U);
}

TEST(WriteFile, MakesTheTargetOfALink) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "elsewhere");
  fs::create_symlink("second", folder / "first");
  fs::create_symlink("elsewhere/target", folder / "second");
  write_file(folder / "first", "new");
  EXPECT_EQ(file_text(folder / "elsewhere/target"), "new");
  EXPECT_TRUE(fs::is_symlink(folder / "first"));
  EXPECT_TRUE(fs::is_symlink(folder / "second"));
  fs::create_symlink("circle", folder / "circle");
  expect_error<std::runtime_error>([&] { write_file(folder / "circle", "new"); }, "circle");
  EXPECT_TRUE(fs::is_symlink(folder / "circle"));
}

TEST(WriteFile, LeavesAnUnfinishedFileOfItsNameAlone) {
  const TemporaryFolder folder;
  const std::string part = ".dynfilter-part-" + std::to_string(::getpid()) + "-0";
  folder.write(part, "of an earlier process");
  write_file(folder / "file", "text");
  EXPECT_EQ(file_text(folder / "file"), "text");
  EXPECT_EQ(file_text(folder / part), "of an earlier process");
  EXPECT_EQ(entries(folder.path()), 2U);
}

TEST(WriteFile, WritesToADeviceAndRefusesAFolder) {
  EXPECT_NO_THROW(write_file("/dev/null", "text"));
  expect_error<std::runtime_error>([] { write_file("/dev/full", "text"); },
                                   "/dev/full: cannot be written: No space left");
  const TemporaryFolder folder;
  expect_error<std::runtime_error>([&] { write_file(folder.path(), "text"); },
                                   folder.path().string() + ": cannot be written: Is a directory");
}

TEST(Fingerprint, IsThatOfAFilesBytesOnly) {
  const TemporaryFolder folder;
  folder.write("file", "text");
  EXPECT_TRUE(fingerprint_of_file(folder / "file") == fingerprint_of("text"));
  EXPECT_FALSE(fingerprint_of_file(folder / "file") == fingerprint_of("Text"));
  expect_error<std::runtime_error>([&] { fingerprint_of_file(folder.path()); },
                                   folder.path().string() + ": cannot be read");
  EXPECT_TRUE(parse_hash("0123456789abcdef"));
  for (const char* text : {"0123456789abcdeg", "0123456789ABCDEF", "0123456789abcde", ""}) {
    EXPECT_FALSE(parse_hash(text)) << text;
  }
}

TEST(OutputFolder, ListsFilesAndNoFolders) {
  const TemporaryFolder folder;
  folder.write("1.5.png", "");
  folder.write("other.png", "");
  fs::create_directory(folder / "2.5.png");
  EXPECT_EQ(png_files(folder.path()).size(), 2U);
  EXPECT_EQ(timed_png_files(folder.path()), std::vector<fs::path>{folder / "1.5.png"});
  EXPECT_TRUE(png_files(folder / "absent").empty());
  EXPECT_TRUE(files_below(folder / "absent").empty());
}

std::string row(const std::string& name, const std::string& text) {
  return manifest_row(fingerprint_of(text), name) + '\n';
}

/// Files that the list of the writer `test` names.
std::vector<std::string> held(const fs::path& folder, const std::vector<std::string>& names) {
  const EarlierFiles earlier(folder, "test");
  std::vector<std::string> found;
  std::copy_if(names.begin(), names.end(), std::back_inserter(found),
               [&](const std::string& name) { return earlier.holds(name); });
  return found;
}

TEST(EarlierFiles, HoldUnchangedFilesOfTheFolderItself) {
  const TemporaryFolder folder;
  const std::vector<std::string> names = {"same",   "changed",    "gone",
                                          "folder", "below/same", "elsewhere/same"};
  std::string list = manifest_title("test") + '\n';
  for (const std::string& name : names) list += row(name, "text");
  folder.write("out/" + manifest_name("test"), list);
  for (const char* name : {"out/same", "out/below/same", "real/same", "out/unlisted"}) {
    folder.write(name, "text");
  }
  folder.write("out/changed", "Text");
  fs::create_directory(folder / "out/folder");
  fs::create_directory_symlink(folder / "real", folder / "out/elsewhere");
  std::vector<std::string> asked = names;
  asked.push_back("unlisted");
  EXPECT_EQ(held(folder / "out", asked), (std::vector<std::string>{"same", "below/same"}));
}

TEST(EarlierFiles, OfAMalformedListAreRefusedOrUnknown) {
  const TemporaryFolder folder;
  const std::string title = manifest_title("test") + '\n', hash = "0123456789abcdef";
  folder.write("same", "text");
  const auto list = [&](const std::string& text) {
    folder.write(manifest_name("test"), title + text);
  };
  list(row("same", "text") + "4\n");  // version 0.1 listed no hashes
  EXPECT_TRUE(held(folder.path(), {"same"}).empty());
  for (const char* bad :
       {"5/0123456789abcdef\n", "-5/0123456789abcdef/same\n", "5/0123456789abcdef/../same\n"}) {
    list(bad);
    expect_error<std::runtime_error>([&] { EarlierFiles(folder.path(), "test"); },
                                     "want size/hash/name");
  }
}

}  // namespace
}  // namespace dynfilter::detail
