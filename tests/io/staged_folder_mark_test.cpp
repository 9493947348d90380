// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A folder that comes from somebody else may hold any mark of an interrupted exchange, and links
// with the names of hidden folders: nothing outside the folder is moved or removed.

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "io/staged_folder.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::file_text;
using testing::TemporaryFolder;

/// All files below a folder, with their text.
std::map<fs::path, std::string> files_in(const fs::path& folder) {
  std::map<fs::path, std::string> files;
  for (const fs::path& file : files_below(folder)) files[file] = file_text(folder / file);
  return files;
}

/// Puts a mark of writer `test` into folder `out`, beside the file `mine` and folder `project`.
void mark(const TemporaryFolder& folder, const std::string& area, const std::string& names) {
  folder.write("mine", "mine");
  folder.write("project/old/thing", "mine");
  fs::create_directories(folder / "out" / area / "new");
  fs::create_directories(folder / "out" / area / "old");
  folder.write("out/" + area + "/owner", "dynfilter test is writing here\n");
  folder.write("out/.dynfilter-commit", "test\n" + area + '\n' + names);
}

TEST(StagedFolder, MarkCannotReachOutsideTheFolder) {
  const std::string own = ".dynfilter-test-1";
  const std::pair<std::string, std::string> marks[] = {{own, "/tmp/mine\n"},
                                                       {own, "../mine\n"},
                                                       {own, "parts/../../mine\n"},
                                                       {own, "\n"},
                                                       {"../project", "key\n"},
                                                       {own + "/../../project", ""},
                                                       {"..", "key\n"},
                                                       {".dynfilter-other-1", "key\n"},
                                                       {"parts", "key\n"}};
  for (const auto& [area, names] : marks) {
    SCOPED_TRACE(area + ' ' + names);
    const TemporaryFolder folder;
    fs::create_directories(folder / "out");
    mark(folder, area, names);
    folder.write("out/mine", "mine");
    const auto before = files_in(folder.path());
    for (const bool overwrite : {false, true}) {
      expect_error<std::runtime_error>(
          [&] { StagedFolder(folder / "out", "test", {"key"}, overwrite); },
          ".dynfilter-commit: names files that dynfilter cannot have moved there");
    }
    EXPECT_EQ(files_in(folder.path()), before);
  }
}

TEST(StagedFolder, MarkCannotReachThroughALink) {
  for (const char* link : {"parts", ".dynfilter-test-1/new/parts", ".dynfilter-test-1/old/parts",
                           ".dynfilter-test-1"}) {
    SCOPED_TRACE(link);
    const TemporaryFolder folder;
    folder.write("elsewhere/0", "mine");
    if (std::string(link) != ".dynfilter-test-1") mark(folder, ".dynfilter-test-1", "parts/0\n");
    fs::create_directories(folder / "out");
    fs::create_directory_symlink(folder / "elsewhere", folder / "out" / link);
    folder.write("out/.dynfilter-commit", "test\n.dynfilter-test-1\nparts/0\n");
    expect_error<std::runtime_error>([&] { StagedFolder(folder / "out", "test", {"key"}, true); },
                                     ".dynfilter-commit: names files");
    EXPECT_EQ(file_text(folder / "elsewhere/0"), "mine");
  }
}

TEST(StagedFolder, LeavesLinksWithTheNameOfAHiddenFolder) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "empty");
  folder.write("project/owner", "dynfilter test is writing here\n");
  folder.write("project/old/thing", "mine");
  fs::create_directories(folder / "out");
  fs::create_directory_symlink(folder / "empty", folder / "out" / ".dynfilter-test-1");
  fs::create_directory_symlink(folder / "project", folder / "out" / ".dynfilter-test-2");
  const auto before = files_in(folder.path());
  { StagedFolder staged(folder / "out", "test", {"key"}, true); }
  EXPECT_EQ(files_in(folder.path()), before);
  EXPECT_TRUE(fs::is_symlink(folder / "out" / ".dynfilter-test-1"));
  EXPECT_TRUE(fs::is_directory(folder / "empty"));
}

}  // namespace
}  // namespace dynfilter::detail
