// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A folder of results shows nothing until its writer is done, and loses no file of anybody else.

#include "io/staged_folder.hpp"

#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/file_tree.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::file_text;
using testing::FileTree;
using testing::TemporaryFolder;
using testing::visible_tree;

/// Results of which one file, in a subfolder, has the name of the content.
FileTree results(const std::string& content) {
  return {{"key", content}, {"parts/0", content}, {"only/" + content, content}};
}

void write(const StagedFolder& staged, const FileTree& files) {
  for (const auto& [name, text] : files) {
    fs::create_directories((staged.path() / name).parent_path());
    write_file(staged.path() / name, text);
  }
}

void put(const fs::path& folder, const FileTree& files, bool overwrite = true) {
  StagedFolder staged(folder, "test", overwrite);
  write(staged, files);
  staged.commit();
}

void expect_refused(const fs::path& folder, const std::string& part, bool overwrite = true) {
  const FileTree before = testing::file_tree(folder);
  expect_error<std::runtime_error>([&] { put(folder, results("new"), overwrite); }, part);
  EXPECT_EQ(testing::file_tree(folder), before);
}

TEST(StagedFolder, ShowsNothingUntilFinishedAndCleansUp) {
  const TemporaryFolder folder;
  {
    StagedFolder staged(folder / "new/out/", "test", false);
    write(staged, results("first"));
    EXPECT_TRUE(visible_tree(folder / "new/out").empty());
    staged.commit();
  }
  EXPECT_EQ(visible_tree(folder / "new/out"), results("first"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "new/out"), {}), 4)
      << "it should hold key, parts, only, and the list of files";
  { const StagedFolder unused(folder / "other/out", "test", false); }
  EXPECT_FALSE(fs::exists(folder / "other"));
}

TEST(StagedFolder, ReplacesItsOwnFilesOnRequestAndKeepsOthers) {
  const TemporaryFolder folder;
  put(folder.path(), results("first"));
  folder.write("parts/mine", "mine");
  folder.write("only/mine", "mine");
  expect_refused(folder.path(), "holds key already; name another folder, or overwrite it", false);
  put(folder.path(), results("second"));
  FileTree want = results("second");
  want["parts/mine"] = want["only/mine"] = "mine";
  EXPECT_EQ(visible_tree(folder.path()), want);
}

TEST(StagedFolder, RefusesFilesOfOthers) {
  for (const char* file : {"key", "anything", "below/anything"}) {
    const TemporaryFolder folder;
    folder.write(file, "mine");
    expect_refused(folder.path(), std::string("holds ") + file + ", which no earlier dynfilter");
  }
  const TemporaryFolder folder;
  folder.write(".dynfilter-test.txt", "# a list of another version\nkey\n");
  folder.write("key", "mine");
  expect_refused(folder.path(), "holds key, which no earlier dynfilter test wrote");
}

TEST(StagedFolder, RefusesAFileThatAppearsMeanwhileAndMayBeFinishedLater) {
  const TemporaryFolder folder;
  StagedFolder staged(folder.path(), "test", false);
  write(staged, results("first"));
  folder.write("parts/0", "mine");
  for (int k = 0; k < 2; ++k) {
    expect_error<std::runtime_error>([&] { staged.commit(); }, "holds parts/0");
    EXPECT_EQ(visible_tree(folder.path()), (FileTree{{"parts/0", "mine"}}));
  }
  fs::remove(folder / "parts/0");
  staged.commit();
  EXPECT_EQ(visible_tree(folder.path()), results("first"));
}

TEST(StagedFolder, NeverReachesOutsideTheFolder) {
  for (const std::string listed : {"../outside", "link/outside", "/outside"}) {
    SCOPED_TRACE(listed);
    const TemporaryFolder folder;
    folder.write("outside", "mine");
    put(folder / "out", results("first"));
    fs::create_directory_symlink(folder.path(), folder / "out/link");
    const std::string name = listed[0] == '/' ? (folder / "outside").string() : listed;
    append_to_file(folder / "out" / list_name("test"), name + '\n');
    put(folder / "out", results("second"));
    EXPECT_EQ(file_text(folder / "outside"), "mine");
  }
  const TemporaryFolder folder;
  put(folder / "out", results("first"));
  fs::rename(folder / "out/parts", folder / "parts");
  fs::create_directory_symlink(folder / "parts", folder / "out/parts");
  expect_refused(folder / "out", "is no folder of");
  EXPECT_EQ(file_text(folder / "parts/0"), "first");
}

TEST(StagedFolder, OfAnotherWriterMayLieInIt) {
  const TemporaryFolder folder;
  StagedFolder outer(folder.path(), "outer", false);
  StagedFolder inner(folder / "parts", "inner", false);
  write(outer, {{"key", "outer"}});
  write(inner, {{"0", "inner"}});
  inner.commit();
  outer.commit();
  EXPECT_EQ(visible_tree(folder.path()), (FileTree{{"key", "outer"}, {"parts/0", "inner"}}));
}

}  // namespace
}  // namespace dynfilter::detail
