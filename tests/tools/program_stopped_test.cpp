// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A sub-command that is killed or runs out of disk space leaves the complete old results, the
// complete new ones, or nothing that a reader accepts.

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <thread>

#include "support/replacement_test.hpp"

namespace dynfilter::testing {
namespace {

using ProgramStopped = ReplacementTest;

/// Runs the program and kills it after some time, unless it ended before.
void run_and_kill(const std::string& arguments, std::chrono::microseconds after) {
  const std::string command = "exec '" DYNFILTER_PROGRAM "' " + arguments + " >/dev/null 2>&1";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  std::this_thread::sleep_for(after);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
}

std::chrono::microseconds time_of(const std::function<void()>& action) {
  const auto begin = std::chrono::steady_clock::now();
  action();
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() -
                                                               begin);
}

TEST_F(ProgramStopped, KilledAtAnyMomentLeavesOldOrNewResultsOrNone) {
  const char* wanted = std::getenv("DYNFILTER_KILLS");
  const int kills = wanted == nullptr ? 4 : std::atoi(wanted);
  std::mt19937 random(16);
  for (const Replacement& command : replacements()) {
    SCOPED_TRACE(command.name);
    const FileTree earlier = made(command.earlier, folder_ / "earlier" / command.name);
    FileTree later;
    const auto whole_time =
        time_of([&] { later = made(command.later, folder_ / "later" / command.name); });
    ASSERT_NE(earlier, later);
    for (int k = 0; k < kills; ++k) {
      SCOPED_TRACE(k);
      const fs::path out = folder_ / (command.name + std::to_string(k));
      const bool is_fresh = k % 3 == 0;
      if (!is_fresh) made(command.earlier, out);
      const auto after = whole_time * static_cast<int>(random() % 1000) / 1000;
      run_and_kill(command.later + quoted(out), after);

      const FileTree found =
          fs::exists(out / ".dynfilter-commit") ? FileTree() : without_times(visible_tree(out));
      const FileTree& before = is_fresh ? FileTree() : earlier;
      EXPECT_TRUE(found == before || found == later || found.empty());
      EXPECT_EQ(command.is_read(out), !found.empty());
      EXPECT_EQ(made(command.later, out), later) << "a repeated call must succeed";
    }
  }
}

/// Expects the outcome of a call that may run out of space: all new files, or an error that names a
/// file.
void expect_whole(const Outcome& outcome, const fs::path& out, const FileTree& earlier,
                  const FileTree& later) {
  const FileTree found = without_times(visible_tree(out));
  if (outcome.exit_code == 0) {
    EXPECT_EQ(found, later);
  } else {
    EXPECT_EQ(found, earlier);
    EXPECT_TRUE(outcome.mentions("cannot be")) << outcome.printed;
    EXPECT_TRUE(outcome.mentions(out.string() + "/")) << outcome.printed;
  }
  for (const auto& [name, text] : file_tree(out)) {
    EXPECT_EQ(name.parent_path().string().find(".dynfilter-"), std::string::npos) << name;
  }
}

TEST_F(ProgramStopped, FileSizeLimitKeepsEarlierResults) {
  int failures = 0;
  for (const Replacement& command : replacements()) {
    SCOPED_TRACE(command.name);
    const FileTree later = made(command.later, folder_ / "later" / command.name);
    for (const int blocks : {0, 2, 10, 80, 400}) {
      SCOPED_TRACE(blocks);
      const fs::path out = folder_ / (command.name + std::to_string(blocks));
      const FileTree earlier = made(command.earlier, out);
      // If the signal is ignored, write() fails.
      const std::string shell = "trap '' XFSZ; ulimit -f " + std::to_string(blocks) + "; exec ";
      const Outcome outcome =
          run_in_shell(shell + "'" DYNFILTER_PROGRAM "' " + command.later + quoted(out));
      failures += outcome.exit_code != 0 ? 1 : 0;
      expect_whole(outcome, out, earlier, later);
    }
  }
  EXPECT_GT(failures, 5) << "otherwise the test shows little";
}

/// Small file system, mounted if the system permits.
class SmallDisk {
 public:
  SmallDisk(const fs::path& folder, int kilobytes) : folder_(folder) {
    fs::create_directories(folder);
    const std::string size = "size=" + std::to_string(kilobytes) + "k";
    is_mounted_ = mount("tmpfs", folder.c_str(), "tmpfs", 0, size.c_str()) == 0;
  }
  ~SmallDisk() {
    if (is_mounted_) umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  bool is_mounted() const { return is_mounted_; }

 private:
  fs::path folder_;
  bool is_mounted_;
};

TEST_F(ProgramStopped, FullDiskKeepsEarlierResults) {
  int failures = 0;
  for (const Replacement& command : replacements()) {
    SCOPED_TRACE(command.name);
    const FileTree later = made(command.later, folder_ / "later" / command.name);
    std::size_t earlier_bytes = 0;
    for (const auto& [name, text] : made(command.earlier, folder_ / "earlier" / command.name)) {
      earlier_bytes += (text.size() + 4095) / 4096 * 4096;
    }
    for (const int more_kilobytes : {8, 40, 100, 250, 2000}) {
      SCOPED_TRACE(more_kilobytes);
      const SmallDisk disk(folder_ / "disk",
                           static_cast<int>(earlier_bytes / 1024) + 24 + more_kilobytes);
      if (!disk.is_mounted()) GTEST_SKIP() << "mounting a small file system is not permitted";
      const fs::path out = folder_ / "disk/out";
      // Made elsewhere, because making it needs more space than the result takes.
      made(command.earlier, folder_ / "copied");
      fs::copy(folder_ / "copied", out, fs::copy_options::recursive);
      const FileTree earlier = without_times(visible_tree(out));
      const Outcome outcome = run(command.later + quoted(out));
      failures += outcome.exit_code != 0 ? 1 : 0;
      expect_whole(outcome, out, earlier, later);
      fs::remove_all(folder_ / "copied");
    }
  }
  EXPECT_GT(failures, 5) << "otherwise the test shows little";
}

TEST_F(ProgramStopped, FailedTableKeepsTheEarlierOne) {
  const std::string truth = quoted(folder_ / "scene/groundtruth.txt");
  const std::string command =
      "eval " + truth + " " + truth + " --frames 1 --json " + quoted(folder_ / "files/one");
  fs::create_directories(folder_ / "files");
  ASSERT_EQ(run(command).exit_code, 0);
  const FileTree before = file_tree(folder_ / "files");
  const Outcome outcome =
      run_in_shell("trap '' XFSZ; ulimit -f 0; exec '" DYNFILTER_PROGRAM "' " + command);
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_TRUE(outcome.mentions("files/one: cannot be written")) << outcome.printed;
  EXPECT_EQ(file_tree(folder_ / "files"), before);
}

}  // namespace
}  // namespace dynfilter::testing
