// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a StagedFolder undoes after its writer was killed, and what it leaves to somebody else.

#include <sys/stat.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

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

const std::string area = ".dynfilter-test-1";
const std::string list = ".dynfilter-test.txt";

/// A folder in which a writer was killed while it replaced `parts/1`, "old", by "new".
class InterruptedExchange : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write(area + "/owner", "dynfilter test is writing here\n");
    folder_.write(area + "/old/parts/1", "old");
    fs::create_directories(folder_ / area / "new");
    fs::create_directories(folder_ / "parts");
    folder_.write(".dynfilter-commit", "test\n" + area + "\nparts/1\n" + list + "\n");
  }

  /// Writes the list of the new files below `where`.
  void write_list(const std::string& where) {
    folder_.write(where + list,
                  manifest_title("test") + '\n' +
                      manifest_row(fingerprint_of(std::string_view("new")), "parts/1") + '\n');
  }

  void recover() const { StagedFolder::check(folder_.path(), "test", {"parts/1"}, true); }

  void expect_refused_and_kept() {
    const auto before = file_tree(folder_.path());
    expect_error<std::runtime_error>([&] { recover(); },
                                     "parts/1 was put there or changed since; move that file away");
    EXPECT_EQ(file_tree(folder_.path()), before);
  }

  /// Undoes the exchange. The check that follows refuses "old", because the list of what was
  /// written earlier is not part of these tests.
  void expect_undone() {
    expect_error<std::runtime_error>([&] { recover(); }, "holds parts/1, which no earlier");
    EXPECT_EQ(file_text(folder_ / "parts/1"), "old");
    EXPECT_FALSE(fs::exists(folder_ / ".dynfilter-commit"));
  }

  TemporaryFolder folder_;
};

TEST_F(InterruptedExchange, IsUndoneBeforeTheNewFileIsInPlace) {
  folder_.write(area + "/new/parts/1", "new");
  write_list(area + "/new/");
  expect_undone();
}

TEST_F(InterruptedExchange, IsUndoneWhenTheNewFileIsInPlace) {
  folder_.write("parts/1", "new");
  write_list(area + "/new/");
  expect_undone();
}

TEST_F(InterruptedExchange, IsUndoneWhenItsListIsInPlaceToo) {
  folder_.write("parts/1", "new");
  write_list("");
  expect_undone();
}

TEST_F(InterruptedExchange, SparesAFileThatSomebodyPutThereSince) {
  folder_.write(area + "/new/parts/1", "new");
  write_list(area + "/new/");
  folder_.write("parts/1", "mine");
  expect_refused_and_kept();
  fs::remove(folder_ / "parts/1");
  expect_undone();
}

TEST_F(InterruptedExchange, SparesANewFileThatSomebodyEditedSince) {
  folder_.write("parts/1", "new, and edited");
  write_list("");
  expect_refused_and_kept();
  fs::remove(folder_ / "parts/1");
  expect_undone();
}

TEST_F(InterruptedExchange, SparesWhatItCannotKnowWithoutItsList) {
  folder_.write("parts/1", "new");
  expect_refused_and_kept();
}

TEST_F(InterruptedExchange, SparesLinksAndPipes) {
  write_list("");
  folder_.write("elsewhere", "new");
  fs::create_symlink(folder_ / "elsewhere", folder_ / "parts/1");
  expect_refused_and_kept();
  EXPECT_TRUE(fs::is_symlink(folder_ / "parts/1"));
  fs::remove(folder_ / "parts/1");
  ASSERT_EQ(mkfifo((folder_ / "parts/1").c_str(), 0600), 0);
  expect_error<std::runtime_error>([&] { recover(); }, "parts/1 was put there or changed since");
  EXPECT_TRUE(fs::is_fifo(folder_ / "parts/1"));
}

TEST_F(InterruptedExchange, RemovesOnlyTheFoldersThatItMade) {
  folder_.write(area + "/new/a/b/2", "new");
  fs::create_directories(folder_ / "a/b");
  fs::create_directories(folder_ / "mine");
  folder_.write(".dynfilter-commit", "test\n" + area + "\na/b/2\nmine/3\na/b/\na/\n");
  expect_undone();
  EXPECT_FALSE(fs::exists(folder_ / "a"));
  EXPECT_TRUE(fs::is_directory(folder_ / "mine"));
}

TEST_F(InterruptedExchange, RemovesNoLinkThatItsMarkCallsAFolder) {
  fs::create_directories(folder_ / "project");
  fs::create_directory_symlink(folder_ / "project", folder_ / "a");
  for (const std::string made : {"a", "../project", "b/../project"}) {
    folder_.write(".dynfilter-commit", "test\n" + area + "\n" + made + "/\n");
    expect_error<std::runtime_error>([&] { recover(); }, "cannot have moved there");
    EXPECT_TRUE(fs::is_symlink(folder_ / "a"));
    EXPECT_TRUE(fs::is_directory(folder_ / "project"));
  }
}

TEST(StagedFolder, NamesTheFoldersThatItMakesInnerOnesFirst) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "there");
  const std::vector<fs::path> files = {"there/x", "a/b/x", "a/b/y", "a/z", "there/c/x", "top"};
  EXPECT_EQ(missing_folders(folder.path(), files), std::vector<fs::path>({"there/c", "a/b", "a"}));
}

TEST(StagedFolder, LeavesAnEmptyFolderFromWhichItTookNothing) {
  const TemporaryFolder folder;
  const auto put = [&](const fs::path& name) {
    StagedFolder staged(folder.path(), "test", {}, true);
    fs::create_directories((staged.path() / name).parent_path());
    write_file(staged.path() / name, "text");
    staged.commit();
  };
  put("parts/1");
  fs::remove(folder / "parts/1");
  put("other");
  EXPECT_TRUE(fs::is_directory(folder / "parts"));
  put("parts/2");
  put("other");
  EXPECT_FALSE(fs::exists(folder / "parts"));
}

}  // namespace
}  // namespace dynfilter::detail
