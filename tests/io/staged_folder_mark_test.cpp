// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A folder that comes from somebody else may hold any mark of an interrupted exchange, and links
// with the names of hidden folders: nothing outside the folder is moved or removed.

#include <sys/resource.h>

#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "io/staged_folder.hpp"
#include "support/expect_error.hpp"
#include "support/file_tree.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::file_text;
using testing::file_tree;
using testing::TemporaryFolder;

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
    const auto before = file_tree(folder.path());
    for (const bool overwrite : {false, true}) {
      expect_error<std::runtime_error>(
          [&] { StagedFolder(folder / "out", "test", {"key"}, overwrite); },
          ".dynfilter-commit: names files that dynfilter cannot have moved there");
    }
    EXPECT_EQ(file_tree(folder.path()), before);
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
  const auto before = file_tree(folder.path());
  { StagedFolder staged(folder / "out", "test", {"key"}, true); }
  EXPECT_EQ(file_tree(folder.path()), before);
  EXPECT_TRUE(fs::is_symlink(folder / "out" / ".dynfilter-test-1"));
  EXPECT_TRUE(fs::is_directory(folder / "empty"));
}

TEST(StagedFolder, LeavesALinkToAFolderThatIsNotThere) {
  const TemporaryFolder folder;
  fs::create_directory_symlink(folder / "unmounted/results", folder / "results");
  for (const char* out : {"results", "results/a/b"}) {
    expect_error<std::runtime_error>([&] { StagedFolder(folder / out, "test", {}, true); },
                                     "results: is a link to a folder that is not there");
    EXPECT_TRUE(fs::is_symlink(folder / "results"));
  }
}

TEST(StagedFolder, NamesAPathThatCannotBeFollowed) {
  const TemporaryFolder folder;
  fs::create_directory_symlink(folder / "a", folder / "b");
  fs::create_directory_symlink(folder / "b", folder / "a");
  const std::string long_name(300, 'x');
  for (const fs::path& out : {folder / "a", folder / long_name}) {
    expect_error<std::runtime_error>([&] { StagedFolder(out, "test", {}, true); },
                                     out.filename().string());
  }
}

TEST(StagedFolder, LeavesWhatHasTheNameOfItsList) {
  for (const char* name : {".dynfilter-test.txt", ".dynfilter-test.txt/notes"}) {
    const TemporaryFolder folder;
    folder.write(std::string("out/") + name, "mine\n");
    expect_error<std::runtime_error>(
        [&] { StagedFolder(folder / "out", "test", {}, true); },
        ".dynfilter-test.txt: is no list of what dynfilter test wrote");
    EXPECT_EQ(file_text(folder / "out" / name), "mine\n");
  }
}

TEST(StagedFolder, TakesAnEmptyListForThatOfNoFiles) {
  const TemporaryFolder folder;
  folder.write("out/.dynfilter-test.txt", "");
  folder.write("out/result.txt", "mine\n");
  expect_error<std::runtime_error>(
      [&] { StagedFolder(folder / "out", "test", {"result.txt"}, true); }, "result.txt");
  StagedFolder staged(folder / "out", "test", {"other.txt"}, true);
  std::ofstream(staged.path() / "other.txt") << "new\n";
  staged.commit();
  EXPECT_EQ(file_text(folder / "out/other.txt"), "new\n");
  EXPECT_EQ(file_text(folder / "out/result.txt"), "mine\n");
}

TEST(StagedFolder, MakesNothingIfItCannotSayWhoIsWriting) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "out");
  rlimit usual{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &usual), 0);
  const rlimit none = {0, usual.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  std::exception_ptr error;  // looked at later: sanitizers need a descriptor for that
  try {
    StagedFolder(folder / "out", "test", {}, true);
  } catch (...) {
    error = std::current_exception();
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &usual), 0);
  ASSERT_TRUE(error);
  expect_error<std::runtime_error>([&] { std::rethrow_exception(error); },
                                   "owner: cannot be written");
  StagedFolder(folder / "out", "test", {}, true);
  EXPECT_TRUE(fs::is_empty(folder / "out")) << "the hidden folder was recognised";
}

TEST(StagedFolder, LeavesAHiddenFolderThatItCannotList) {
  const TemporaryFolder folder;
  rlimit usual{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &usual), 0);
  {
    StagedFolder staged(folder / "out", "test", {}, true);
    write_file(staged.path() / "key", "unfinished");
    const rlimit none = {0, usual.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &usual), 0);
  EXPECT_FALSE(fs::is_empty(folder / "out"));
  StagedFolder(folder / "out", "test", {}, true);
  EXPECT_TRUE(!fs::exists(folder / "out") || fs::is_empty(folder / "out")) << "it was recognised";
}

}  // namespace
}  // namespace dynfilter::detail
