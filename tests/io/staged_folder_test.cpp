// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A folder holds the results of one writer and never a mixture, whatever errors occur and whenever
// a writer is killed.

#include "io/staged_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace {

/// Number of renames that a process may still do before it is killed; negative: any number.
int changes_left = -1;

/// Number of renames that succeed before one fails, once; negative: any number.
int changes_before_failure = -1;

void count_change() {
  if (changes_left == 0) kill(getpid(), SIGKILL);
  if (changes_left > 0) --changes_left;
}

}  // namespace

// Replaces the C library's function, also for the C++ library.
extern "C" int rename(const char* from, const char* to) noexcept {
  count_change();
  if (changes_before_failure-- == 0) {
    errno = ENOSPC;
    return -1;
  }
  return renameat(AT_FDCWD, from, AT_FDCWD, to);
}
extern "C" int unlink(const char* path) noexcept {
  count_change();
  return unlinkat(AT_FDCWD, path, 0);
}

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::file_text;
using testing::TemporaryFolder;

using Files = std::map<fs::path, std::string>;

/// All visible files of a folder.
Files visible(const fs::path& folder) {
  Files files;
  for (const fs::path& file : visible_files_below(folder)) {
    if (file.string().find(hidden_prefix) == std::string::npos) {
      files[file] = file_text(folder / file);
    }
  }
  return files;
}

/// Results with a key file, many files in a subfolder, and some that only these results have.
Files results(const std::string& content, int count) {
  Files files = {{"key", content}, {"only " + content, content}};
  for (int i = 0; i < count; ++i) files["parts/" + std::to_string(i)] = content;
  return files;
}

void write(StagedFolder& staged, const Files& files) {
  for (const auto& [name, text] : files) {
    fs::create_directories((staged.path() / name).parent_path());
    write_file(staged.path() / name, text);
  }
}

void put(const fs::path& folder, const Files& files) {
  StagedFolder staged(folder, "test", {}, true);
  write(staged, files);
  staged.commit({"key"});
}

std::size_t entries_of(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(StagedFolder, ShowsNothingUntilFinishedAndCleansUp) {
  const TemporaryFolder folder;
  {
    StagedFolder staged(folder / "new/out", "test", {}, false);
    write(staged, results("first", 3));
    EXPECT_TRUE(visible(folder / "new/out").empty());
    staged.commit({"key"});
  }
  EXPECT_EQ(visible(folder / "new/out"), results("first", 3));
  EXPECT_EQ(entries_of(folder / "new/out"), 4U)
      << "it should hold key, only first, parts, and the list of files";
  { const StagedFolder unused(folder / "other/out", "test", {}, false); }
  EXPECT_FALSE(fs::exists(folder / "other"));
}

TEST(StagedFolder, ReplacesResultsOfTheSameWriter) {
  const TemporaryFolder folder;
  folder.write("parts/mine", "mine");
  put(folder.path(), results("first", 3));
  put(folder.path(), results("second", 1));
  Files want = results("second", 1);
  want["parts/mine"] = "mine";
  EXPECT_EQ(visible(folder.path()), want);
}

TEST(StagedFolder, RefusesToReplaceOtherFiles) {
  const TemporaryFolder folder;
  folder.write("key", "mine");
  expect_error<std::runtime_error>([&] { StagedFolder(folder.path(), "test", {"key"}, true); },
                                   "holds key, which no earlier dynfilter test wrote");
  // An undeclared name is found at the end, and nothing changes.
  expect_error<std::runtime_error>([&] { put(folder.path(), results("first", 2)); }, "holds key");
  EXPECT_EQ(visible(folder.path()), (Files{{"key", "mine"}}));
  EXPECT_EQ(entries_of(folder.path()), 1U);

  fs::remove(folder / "key");
  put(folder.path(), results("first", 2));
  folder.write("parts/1", "changed since");
  expect_error<std::runtime_error>([&] { put(folder.path(), results("second", 2)); }, "parts/1");
  EXPECT_EQ(file_text(folder / "parts/1"), "changed since");
  EXPECT_EQ(file_text(folder / "parts/0"), "first");
}

TEST(StagedFolder, RefusesToReplaceAFileThatWasEditedToTheSameSize) {
  const TemporaryFolder folder;
  put(folder.path(), results("first", 2));
  folder.write("parts/1", "fIrst");
  expect_error<std::runtime_error>([&] { put(folder.path(), results("second", 2)); }, "parts/1");
  EXPECT_EQ(file_text(folder / "parts/1"), "fIrst");
}

TEST(StagedFolder, ListWithoutHashesProvesNothing) {
  const TemporaryFolder folder;
  folder.write("key", "mine");
  folder.write(".dynfilter-test.txt", manifest_title("test") + "\n4/key\n");
  expect_error<std::runtime_error>([&] { put(folder.path(), results("first", 1)); }, "holds key");
  EXPECT_EQ(file_text(folder / "key"), "mine");
}

TEST(StagedFolder, FileListCannotReachOutsideTheFolder) {
  for (const char* file : {"../outside", "/outside/../../outside", "link/outside"}) {
    SCOPED_TRACE(file);
    const TemporaryFolder folder;
    folder.write("outside", "mine");
    fs::create_directories(folder / "out");
    fs::create_directory_symlink(folder.path(), folder / "out/link");
    folder.write("out/.dynfilter-test.txt",
                 manifest_title("test") + '\n' + fingerprint_of("mine").text() + '/' + file + "\n");
    expect_error<std::runtime_error>([&] { put(folder / "out", results("first", 1)); }, "out");
    EXPECT_EQ(file_text(folder / "outside"), "mine");
  }
}

TEST(StagedFolder, RemovesOnlyWhatADeadWriterLeft) {
  const TemporaryFolder folder;
  folder.write(".dynfilter-test-1/owner", "dynfilter test is writing here\n");
  folder.write(".dynfilter-test-1/new/parts/7", "half");
  folder.write(".dynfilter-test-2/mine", "mine");
  folder.write(".dynfilter-other-3/owner", "dynfilter other is writing here\n");
  folder.write(".dynfilter-test-4/owner", "");  // killed before it wrote its name
  folder.write(".dynfilter-test-5/owner", "");
  folder.write(".dynfilter-test-5/mine", "mine");
  folder.write(".dynfilter-test-6/owner", "dynfilter test is wri");  // the disk was full
  folder.write(".dynfilter-test-7/owner", "dynfilter test is wri");
  folder.write(".dynfilter-test-7/mine", "mine");
  folder.write(".dynfilter-test-8/owner", "dynfilter te\nis mine");
  put(folder.path(), results("first", 1));
  EXPECT_FALSE(fs::exists(folder / ".dynfilter-test-1"));
  EXPECT_TRUE(fs::exists(folder / ".dynfilter-test-2/mine"));
  EXPECT_TRUE(fs::exists(folder / ".dynfilter-other-3/owner"));
  EXPECT_FALSE(fs::exists(folder / ".dynfilter-test-4"));
  EXPECT_TRUE(fs::exists(folder / ".dynfilter-test-5/mine"));
  EXPECT_FALSE(fs::exists(folder / ".dynfilter-test-6"));
  EXPECT_TRUE(fs::exists(folder / ".dynfilter-test-7/mine"));
  EXPECT_TRUE(fs::exists(folder / ".dynfilter-test-8/owner"));
}

TEST(StagedFolder, RemovesHiddenFoldersOfItsOwnOnly) {
  const TemporaryFolder folder;
  const std::string prefix = hidden_prefix + std::string("test-");
  fs::create_directory(folder / (prefix + "1"));  // killed before it wrote anything
  folder.write(prefix + "2/owner", "somebody else is writing here\n");
  folder.write(prefix + "3", "a file");
  put(folder.path(), results("first", 1));
  EXPECT_FALSE(fs::exists(folder / (prefix + "1")));
  EXPECT_TRUE(fs::exists(folder / (prefix + "2/owner")));
  EXPECT_TRUE(fs::exists(folder / (prefix + "3")));
}

TEST(StagedFolder, RecoversFromAMarkWhoseFilesAreGone) {
  const TemporaryFolder folder;
  const std::string area = hidden_prefix + std::string("test-1");
  folder.write(area + "/owner", "dynfilter test is writing here\n");
  folder.write(area + "/old/key", "old");
  fs::create_directories(folder / (area + "/new"));
  folder.write(commit_mark_name, "test\n" + area + "\ngone\nkey\n");
  StagedFolder::check(folder.path(), "test", {}, true);
  EXPECT_EQ(file_text(folder / "key"), "old");
  EXPECT_FALSE(fs::exists(folder / "gone"));
  EXPECT_FALSE(fs::exists(folder / commit_mark_name));
}

TEST(StagedFolder, NeverWaitsForAPipe) {
  const TemporaryFolder folder;
  const auto make_pipe = [&](const char* name) {
    fs::create_directories((folder / name).parent_path());
    ASSERT_EQ(mkfifo((folder / name).c_str(), 0600), 0);
  };
  make_pipe(".dynfilter-test-1/owner");
  make_pipe(".dynfilter-test.txt");
  expect_error<std::runtime_error>([&] { put(folder.path(), results("first", 1)); },
                                   ".dynfilter-test.txt: is no list");
  fs::remove(folder / ".dynfilter-test.txt");
  put(folder.path(), results("first", 1));
  EXPECT_TRUE(fs::exists(folder / ".dynfilter-test-1/owner"));
  make_pipe(".dynfilter-commit");
  expect_error<std::runtime_error>([&] { put(folder.path(), results("second", 1)); },
                                   ".dynfilter-commit: is not a regular file");
}

TEST(StagedFolder, LeavesARunningWriterAlone) {
  const TemporaryFolder folder;
  StagedFolder first(folder.path(), "test", {}, true);
  write(first, results("first", 2));
  expect_error<std::runtime_error>([&] { put(folder.path(), results("second", 2)); },
                                   "another dynfilter test is writing there");
  put(folder / "next to it", results("third", 1));
  first.commit({"key"});
  EXPECT_EQ(file_text(folder / "parts/1"), "first");
}

bool counts_as_whole(const fs::path& folder) {
  try {
    require_whole(folder);
    return true;
  } catch (const std::runtime_error&) {
    return false;
  }
}

/// Runs `action` in a separate process that is killed at its n-th rename. Returns false if it
/// finished before.
template <class Action>
bool is_killed_at(int change, const Action& action) {
  const pid_t child = fork();
  if (child == 0) {
    changes_left = change;
    action();
    _exit(0);
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFSIGNALED(status);
}

TEST(StagedFolder, KilledAtAnyRenameItHoldsOldOrNewFilesOrSaysIncomplete) {
  const Files old_files = results("old", 3), new_files = results("new", 4);
  int halves = 0;
  bool killed = true;
  for (int change = 0; killed; ++change) {
    SCOPED_TRACE(change);
    const TemporaryFolder folder;
    put(folder.path(), old_files);
    killed = is_killed_at(change, [&] { put(folder.path(), new_files); });
    const Files found = visible(folder.path());
    if (counts_as_whole(folder.path())) {
      EXPECT_EQ(found, killed && found != new_files ? old_files : new_files);
    } else {
      ++halves;
    }
    put(folder.path(), results("next", 2));
    EXPECT_EQ(visible(folder.path()), results("next", 2));
    EXPECT_EQ(entries_of(folder.path()), 4U) << "the dead writer's files should be gone";
  }
  EXPECT_GT(halves, 10) << "otherwise the test shows little";
}

/// Kills an exchange at one rename, and the rollback of the next writer at another. Returns false
/// if there was nothing to roll back, or if the rollback finished before.
bool is_cut_off_twice(int change, int change_back) {
  const Files old_files = results("old", 1);
  const TemporaryFolder folder;
  put(folder.path(), old_files);
  is_killed_at(change, [&] { put(folder.path(), results("new", 2)); });
  if (counts_as_whole(folder.path())) return false;
  const auto put_back = [&] { StagedFolder::check(folder.path(), "test", {}, true); };
  const bool killed = is_killed_at(change_back, put_back);
  put_back();
  EXPECT_TRUE(counts_as_whole(folder.path()));
  EXPECT_EQ(visible(folder.path()), old_files);
  return killed;
}

TEST(StagedFolder, RollbackSurvivesBeingKilled) {
  int times = 0;
  for (int change = 0; change < 30; ++change) {
    for (int back = 0; is_cut_off_twice(change, back); ++back) ++times;
  }
  EXPECT_GT(times, 20) << "otherwise the test shows little";
}

TEST(StagedFolder, FailedRenameLeavesTheOldFiles) {
  const Files old_files = results("old", 3);
  bool failed = true;
  int times = 0;
  for (int change = 0; failed; ++change) {
    SCOPED_TRACE(change);
    const TemporaryFolder folder;
    put(folder.path(), old_files);
    failed = false;
    changes_before_failure = change;
    try {
      put(folder.path(), results("new", 4));
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(folder.path().string()), std::string::npos);
      failed = true;
      ++times;
    }
    changes_before_failure = -1;
    EXPECT_TRUE(counts_as_whole(folder.path()));
    EXPECT_EQ(visible(folder.path()), failed ? old_files : results("new", 4));
    EXPECT_EQ(entries_of(folder.path()), 4U);
  }
  EXPECT_GT(times, 15) << "otherwise the test shows little";
}

TEST(StagedFolder, AnotherWriterRefusesAnIncompleteFolder) {
  const TemporaryFolder folder;
  folder.write(".dynfilter-commit", "test\n.dynfilter-test-1\nkey\n");
  EXPECT_FALSE(counts_as_whole(folder.path()));
  expect_error<std::runtime_error>([&] { StagedFolder(folder.path(), "other", {}, true); },
                                   "holds an incomplete result: dynfilter test was stopped");
  expect_error<std::runtime_error>([&] { put(folder.path(), results("new", 1)); },
                                   "with the other files is gone");
}

}  // namespace
}  // namespace dynfilter::detail
