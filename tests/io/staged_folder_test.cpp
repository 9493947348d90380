// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A folder of results shows nothing until its writer is done, and loses no file of anybody else.

#include "io/staged_folder.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "io/file_writing.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using namespace detail;
namespace fs = std::filesystem;

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
  const FileTree before = file_tree(folder);
  expect_failure([&] { put(folder, results("new"), overwrite); }, part);
  EXPECT_EQ(file_tree(folder), before);
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
    expect_failure([&] { staged.commit(); }, "holds parts/0");
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

// --- Single files --------------------------------------------------------------------------------

TEST(WriteFile, ReplacesAFileAndKeepsItsPermissions) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("file", "old");
  const fs::perms own = fs::perms::owner_read | fs::perms::owner_write;
  fs::permissions(file, own);
  write_file(file, "new");
  EXPECT_EQ(file_text(file), "new");
  EXPECT_EQ(fs::status(file).permissions(), own);
  {
    const FileSizeLimit limit(1);
    expect_failure([&] { write_file(file, "newer"); }, "file: cannot be written: File too large");
  }
  EXPECT_EQ(file_text(file), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(WriteFile, RefusesWhatIsNoRegularFile) {
  const TemporaryFolder folder;
  folder.write("target", "old");
  fs::create_symlink("target", folder / "link");
  fs::create_symlink("made", folder / "dangling");
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  const FileTree before = file_tree(folder.path());
  for (const fs::path& path : {folder / "link", folder / "dangling", folder / "fifo", folder.path(),
                               fs::path("/dev/null")}) {
    for (const auto write : {write_file, append_to_file}) {
      expect_failure([&] { write(path, "new"); }, path.string() + ": is ");
    }
  }
  EXPECT_EQ(file_tree(folder.path()), before);
  for (int k = 0; k < 1000; ++k) {  // the names of parts
    fs::create_symlink("target", folder / (".dynfilter-part-" + std::to_string(getpid()) + '-' +
                                           std::to_string(k)));
  }
  write_file(folder / "file", "new");
  EXPECT_EQ(file_text(folder / "file"), "new");
  EXPECT_EQ(file_text(folder / "target"), "old");
}

// --- Links of an untrusted folder ----------------------------------------------------------------

/// The names below, which the process's number is in; program_safety_test.cpp tries the others.
TEST(StagedFolder, FollowsNoLinkAtItsHiddenFolder) {
  for (const std::string target : {"home/file", "home", "home/nothing"}) {
    SCOPED_TRACE(target);
    const TemporaryFolder folder;
    folder.write("home/file", "mine");
    fs::create_directory(folder / "out");
    fs::create_symlink(folder / target,
                       folder / "out" / (".dynfilter-test-" + std::to_string(getpid()) + "-0"));
    try {
      put(folder / "out", results("new"));
      EXPECT_EQ(target, "home") << "it takes the next name";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("out: cannot be made: "), std::string::npos);
    }
    EXPECT_EQ(file_tree(folder / "home"), (FileTree{{"file", "mine"}}));
  }
}

TEST(StagedFolder, RefusesNamesThatAListCannotHoldAndFoldersThatAreNone) {
  const TemporaryFolder folder;
  expect_failure(
      [&] {
        put(folder / "out", {{"a\nb", ""}});
      },
      "a?b: want a name without control characters");
  folder.write("file", "mine");
  expect_failure([&] { put(folder / "file", results("new")); }, "file: is no folder");
  fs::create_symlink("loop", folder / "loop");
  expect_failure([&] { put(folder / "loop/out", results("new")); },
                 "loop/out: cannot be read: Too many levels");
}

TEST(AppendToFile, AddsAPieceOrNothing) {
  const TemporaryFolder folder;
  append_to_file(folder / "file", "one\n");
  {
    const FileSizeLimit limit(6);
    expect_failure([&] { append_to_file(folder / "file", "two\n"); },
                   "file: cannot be written: File too large");
  }
  append_to_file(folder / "file", "three\n");
  EXPECT_EQ(file_text(folder / "file"), "one\nthree\n");
}

}  // namespace
}  // namespace dynfilter::testing
