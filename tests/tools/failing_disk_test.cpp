// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A disk fails at the n-th change of a folder, once or from then on: the sub-command says so and
// names a file, the folder holds whole results, old or new, or nothing that a reader accepts, and
// no input changes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "io/fingerprint.hpp"
#include "support/fault_count.hpp"
#include "support/replacement_test.hpp"

namespace dynfilter::testing {
namespace {

class FailingDisk : public ReplacementTest {
 protected:
  FailingDisk() { input_ = file_tree(folder_ / "scene"); }

  /// Runs the program; the disk below `folder` fails at that change, or never at 0. `more` are
  /// further variables.
  Outcome run_failing(const std::string& arguments, const fs::path& folder, int at, bool lasts,
                      const std::string& more = "") const {
    return run_in_shell(
        more + " FAILING_DISK_FOLDER=" + quoted(folder) + " FAILING_DISK_AT=" + std::to_string(at) +
        (lasts ? " FAILING_DISK_LASTS=1" : "") +
        " FAILING_DISK_COUNT=" + quoted(folder_ / "count") +
        " LD_PRELOAD='" DYNFILTER_FAILING_DISK "' '" DYNFILTER_PROGRAM "' " + arguments);
  }

  /// Calls `check(outcome, at)` with every change that this call makes, or with some of them, among
  /// them the last ones, which tidy up, and `prepare` before each. Returns the number of checks.
  template <class Prepare, class Check>
  int at_each_change(const std::string& arguments, const fs::path& folder, const Prepare& prepare,
                     const Check& check) {
    prepare();
    const Outcome whole = run_failing(arguments, folder, 0, false);
    EXPECT_EQ(whole.exit_code, 0) << whole.printed;
    const int changes = std::stoi(file_text(folder_ / "count"));
    EXPECT_GT(changes, 3) << "otherwise the test shows nothing";
    const bool is_thorough = std::getenv("DYNFILTER_EVERY_FAILURE") != nullptr;
    const int step = is_thorough ? 1 : std::max(1, changes / 3);
    int checks = 0;
    for (const bool lasts : {false, true}) {
      const int tidying = lasts ? 0 : 6;  // with the mark of an exchange, in a new folder
      int next = lasts ? 1 + step / 2 : 1;
      for (int at = 1; at <= changes; ++at) {
        if (at != next && at <= changes - tidying) continue;
        if (at == next) next += step;
        SCOPED_TRACE("change " + std::to_string(at) + " of " + std::to_string(changes) +
                     (lasts ? " and all later ones" : ""));
        prepare();
        check(run_failing(arguments, folder, at, lasts), at);
        EXPECT_EQ(changed_names(input_, file_tree(folder_ / "scene")), "");
        ++checks;
      }
    }
    count_faults("failed changes of a folder", checks);
    return checks;
  }

 private:
  FileTree input_;
};

/// Tells whether a writer's hidden folder is there.
bool has_leftovers(const fs::path& folder) {
  if (!fs::exists(folder)) return false;
  const fs::directory_iterator entries(folder);
  return std::any_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    return entry.is_directory() && entry.path().filename().string().rfind(".dynfilter-", 0) == 0;
  });
}

void expect_error_names(const Outcome& outcome, const fs::path& folder) {
  EXPECT_TRUE(outcome.mentions(folder.string())) << outcome.printed;
}

TEST_F(FailingDisk, LeavesOldOrNewResultsOrNone) {
  for (const Replacement& command : replacements()) {
    const fs::path out = folder_ / "out";
    const FileTree later = made(command.later, folder_ / "later" / command.name);
    const FileTree earlier = made(command.earlier, folder_ / "earlier" / command.name);
    for (const bool is_fresh : {true, false}) {
      SCOPED_TRACE(command.name + (is_fresh ? " into a new folder" : " over earlier results"));
      const FileTree before = is_fresh ? FileTree() : earlier;
      const auto prepare = [&] {
        fs::remove_all(out);
        if (!is_fresh) {
          fs::copy(folder_ / "earlier" / command.name, out, fs::copy_options::recursive);
        }
      };
      at_each_change(command.later + quoted(out), out, prepare, [&](const Outcome& got, int at) {
        const bool is_incomplete = fs::exists(out / ".dynfilter-commit");
        if (got.exit_code != 0) expect_error_names(got, out);
        const FileTree found = without_times(visible_tree(out));
        const bool is_whole = found == later || (got.exit_code != 0 && found == before);
        EXPECT_TRUE(is_whole || is_incomplete) << got.printed;
        if (is_incomplete) {
          EXPECT_NE(got.exit_code, 0);
          // Only the list of files may be missing beside results that a reader accepts.
          EXPECT_TRUE(is_whole || !command.is_read(out)) << got.printed;
        }
        if (is_incomplete || has_leftovers(out) || at % 5 == 0) {
          EXPECT_TRUE(made(command.later, out) == later) << "a repeated call must succeed";
          EXPECT_FALSE(has_leftovers(out)) << "a repeated call must tidy up";
        }
      });
    }
  }
}

TEST_F(FailingDisk, AnAblationHoldsWholeRunsOnly) {
  const std::string call =
      "ablate " + quoted(folder_ / "scene") + " --rules none,depth --features 200 --out ";
  ASSERT_EQ(run(call + quoted(folder_ / "whole")).exit_code, 0);
  const fs::path out = folder_ / "out";
  const auto prepare = [&] { fs::remove_all(out); };
  at_each_change(call + quoted(out), out, prepare, [&](const Outcome& got, int at) {
    if (got.exit_code != 0) expect_error_names(got, out);
    for (const char* rule : {"none", "depth"}) {
      const fs::path folder = out / "scene" / rule;
      if (fs::exists(folder / ".dynfilter-commit")) continue;  // no reader accepts it
      const FileTree found = without_times(visible_tree(folder));
      const FileTree wanted = without_times(visible_tree(folder_ / "whole/scene" / rule));
      EXPECT_TRUE(found == wanted || (got.exit_code != 0 && found.empty())) << got.printed;
    }
    if (at % 5 == 0) {
      EXPECT_EQ(run(call + quoted(out)).exit_code, 0) << "a repeated call must succeed";
    }
  });
}

TEST_F(FailingDisk, AListOfPairsIsTheOldOrTheNewOne) {
  const fs::path out = folder_ / "out", file = out / "pairs.txt";
  const std::string call = "sync " + quoted(folder_ / "scene") + " --write " + quoted(file);
  const std::string beginning = "# written by dynfilter sync, checksum ", rest = ", earlier\n";
  const std::string earlier =
      beginning + detail::hash_text(detail::fingerprint_of(beginning + rest).hash) + rest;
  folder_.write("out/pairs.txt", earlier);
  ASSERT_EQ(run(call).exit_code, 0);
  const std::string later = file_text(file);
  ASSERT_NE(later, earlier);
  const auto prepare = [&] {
    fs::remove_all(out);
    folder_.write("out/pairs.txt", earlier);
  };
  at_each_change(call, out, prepare, [&](const Outcome& got, int /* at */) {
    EXPECT_NE(got.exit_code, 0);
    expect_error_names(got, file);
    EXPECT_EQ(file_text(file), earlier);
    for (const auto& [name, text] : file_tree(out)) {
      EXPECT_TRUE(name == "pairs.txt" || got.mentions(name.string()))
          << name << " is an unfinished file, of which nobody was told";
    }
  });
}

TEST_F(FailingDisk, ASignalDuringAWriteLosesNothing) {
  const fs::path out = folder_ / "out", file = out / "pairs.txt";
  fs::create_directory(out);
  const std::string call = "sync " + quoted(folder_ / "scene") + " --write " + quoted(file);
  ASSERT_EQ(run_failing(call, out, 0, false).exit_code, 0);
  const std::string whole = file_text(file);
  const int changes = std::stoi(file_text(folder_ / "count"));
  int interrupted = 0;
  for (int at = 1; at <= changes; ++at) {
    fs::remove(file);
    EXPECT_EQ(run_failing(call, out, at, false, "FAILING_DISK_SIGNAL=1").exit_code, 0);
    EXPECT_EQ(file_text(file), whole);
    interrupted += std::stoi(file_text(folder_ / "count")) > changes ? 1 : 0;  // written again
  }
  EXPECT_GE(interrupted, 1);
}

}  // namespace
}  // namespace dynfilter::testing
