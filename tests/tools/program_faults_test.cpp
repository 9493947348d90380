// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Faults of the program's surroundings: an ablation that is killed, a user who interrupts, two runs
// into one folder, times that go back, repeat or jump. No input ever changes.

#include <gtest/gtest.h>

#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "support/file_tree.hpp"
#include "support/program.hpp"
#include "support/started_program.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

/// All files but the hidden ones, without the run times of summaries.
FileTree results_in(const fs::path& folder) {
  FileTree files = visible_tree(folder);
  for (auto& [name, text] : files) {
    if (name.filename() != "summary.json") continue;
    nlohmann::json json = nlohmann::json::parse(text);
    json.erase("times_ms");
    text = json.dump();
  }
  return files;
}

class ProgramFaults : public ::testing::Test {
 protected:
  ProgramFaults() {
    const Outcome synth = run("synth " + quoted(scene()) + " --frames 8 --width 160 --height 120");
    if (synth.exit_code != 0) throw std::runtime_error(synth.printed);
    input_ = file_tree(scene());
  }
  /// No input changes, whatever happened.
  ~ProgramFaults() override { EXPECT_EQ(changed_names(input_, file_tree(scene())), ""); }

  fs::path scene() const { return folder_ / "scene"; }

  /// Moments from the begin of a call to its end.
  std::vector<std::chrono::microseconds> moments(const std::string& call, int count) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(run(call + quoted(folder_ / "timed")).exit_code, 0);
    const auto whole = std::chrono::steady_clock::now() - begin;
    std::vector<std::chrono::microseconds> made;
    for (int k = 0; k < count; ++k) {
      made.push_back(std::chrono::duration_cast<std::chrono::microseconds>(
          whole * static_cast<int>(random_() % 1000) / 1000));
    }
    return made;
  }

  static int kills() {
    const char* wanted = std::getenv("DYNFILTER_KILLS");
    return wanted == nullptr ? 4 : std::atoi(wanted);
  }

  TemporaryFolder folder_;
  std::mt19937 random_{17};

 private:
  FileTree input_;
};

TEST_F(ProgramFaults, KilledAblationHoldsWholeRunsOnly) {
  const std::string call =
      "ablate " + quoted(scene()) + " --rules none,depth --features 200 --out ";
  const std::vector<std::chrono::microseconds> when = moments(call, kills());
  const FileTree wanted = results_in(folder_ / "timed");
  ASSERT_GT(wanted.size(), 5U);
  for (std::size_t k = 0; k < when.size(); ++k) {
    SCOPED_TRACE(k);
    const fs::path out = folder_ / ("out" + std::to_string(k));
    if (k % 2 == 1) fs::copy(folder_ / "timed", out, fs::copy_options::recursive);
    const Started ablation(call + quoted(out), folder_ / "printed");
    std::this_thread::sleep_for(when[k]);
    ablation.send(SIGKILL);
    ablation.wait();
    for (const char* rule : {"none", "depth"}) {
      const fs::path folder = out / "scene" / rule;
      if (fs::exists(folder / ".dynfilter-commit")) continue;  // no reader accepts it
      const FileTree found = results_in(folder);
      if (found.empty()) continue;
      EXPECT_EQ(found, results_in(folder_ / "timed/scene" / rule)) << rule;
    }
    EXPECT_EQ(run(call + quoted(out)).exit_code, 0) << "a repeated call must succeed";
    EXPECT_EQ(results_in(out), wanted);
  }
}

TEST_F(ProgramFaults, InterruptedCallSaysWhatIsThereAndLeavesNothingElse) {
  const std::string calls[] = {
      "run " + quoted(scene()) + " --features 2000 --overlays 0 --out ",
      "ablate " + quoted(scene()) + " --rules none,depth --features 2000 --out ",
      "synth --overwrite --frames 12 --width 320 --height 240 "};
  int interrupted = 0;
  for (const std::string& call : calls) {
    SCOPED_TRACE(call);
    const std::vector<std::chrono::microseconds> when = moments(call, kills());
    const FileTree wanted = results_in(folder_ / "timed");
    for (std::size_t k = 0; k < when.size(); ++k) {
      const fs::path out = folder_ / "interrupted";
      const Started program(call + quoted(out), folder_ / "printed");
      std::this_thread::sleep_for(when[k]);
      program.send(k % 2 == 0 ? SIGINT : SIGTERM);
      const int status = program.wait();
      const bool says_so = program.printed().find("interrupted: each folder") != std::string::npos;
      if (says_so) {
        ++interrupted;
        ASSERT_TRUE(WIFSIGNALED(status)) << "callers must see the signal";
        EXPECT_EQ(WTERMSIG(status), k % 2 == 0 ? SIGINT : SIGTERM);
        EXPECT_TRUE(!fs::exists(out) || file_tree(out).empty()) << "something is left";
      } else if (WIFEXITED(status)) {
        EXPECT_EQ(results_in(out), wanted) << "it had ended before";
      } else {
        const FileTree found = results_in(out);
        EXPECT_TRUE(found.empty() || found == wanted) << "it had not begun, or ended just now";
      }
      fs::remove_all(out);
    }
    fs::remove_all(folder_ / "timed");
  }
  EXPECT_GT(interrupted, 0);
}

TEST_F(ProgramFaults, InterruptedRunLeavesEarlierResultsOrItsOwn) {
  const auto call = [&](int features) {
    return "run " + quoted(scene()) + " --overlays 0 --features " + std::to_string(features) +
           " --out ";
  };
  const std::vector<std::chrono::microseconds> when = moments(call(2000), kills());
  const FileTree later = results_in(folder_ / "timed");
  const fs::path out = folder_ / "interrupted";
  ASSERT_EQ(run(call(300) + quoted(out)).exit_code, 0);
  const FileTree earlier = results_in(out);
  ASSERT_NE(earlier, later);
  for (const std::chrono::microseconds moment : when) {
    const Started program(call(2000) + quoted(out), folder_ / "printed");
    std::this_thread::sleep_for(moment);
    program.send(SIGINT);
    const int status = program.wait();
    const FileTree found = results_in(out);
    EXPECT_TRUE(found == earlier || found == later);
    EXPECT_TRUE(!WIFEXITED(status) || found == later);
    if (found == later) {
      ASSERT_EQ(run(call(300) + quoted(out)).exit_code, 0);
    }
  }
}

// Two that begin at the same moment may both refuse: each sees that the other one is working.
TEST_F(ProgramFaults, TwoRunsIntoOneFolderLeaveOneWholeResultOrNone) {
  const auto call = [&](int features) {
    return "run " + quoted(scene()) + " --overlays 0 --features " + std::to_string(features) +
           " --out ";
  };
  ASSERT_EQ(run(call(200) + quoted(folder_ / "first")).exit_code, 0);
  ASSERT_EQ(run(call(300) + quoted(folder_ / "second")).exit_code, 0);
  for (int k = 0; k < 4; ++k) {
    const fs::path out = folder_ / "shared";
    const Started first(call(200) + quoted(out), folder_ / "printed1");
    const Started second(call(300) + quoted(out), folder_ / "printed2");
    const bool first_is_done = first.wait() == 0, second_is_done = second.wait() == 0;
    const FileTree found = results_in(out);
    EXPECT_TRUE((first_is_done && found == results_in(folder_ / "first")) ||
                (second_is_done && found == results_in(folder_ / "second")) ||
                (!first_is_done && !second_is_done && found.empty()));
    for (const auto& [is_done, printed] :
         {std::pair(first_is_done, first.printed()), std::pair(second_is_done, second.printed())}) {
      if (!is_done) {
        EXPECT_NE(printed.find("error: "), std::string::npos) << printed;
        EXPECT_NE(printed.find(out.string()), std::string::npos) << printed;
      }
    }
    fs::remove_all(out);
  }
}

/// A table of images whose times are odd is refused with its line, or read in the order of its
/// times.
TEST_F(ProgramFaults, TimesThatGoBackRepeatOrJump) {
  const fs::path odd = folder_ / "odd";
  fs::copy(scene(), odd, fs::copy_options::recursive);
  fs::remove_all(odd / "masks");
  fs::remove_all(odd / "masks_true");
  const auto row = [&](const std::string& time, int image) {
    const std::string name = std::to_string(1 + image / 30.0).substr(0, 8) + ".png";
    return time + " rgb/" + name + " " + time + " depth/" + name + "\n";
  };
  const auto call = "run " + quoted(odd) + " --features 200 --overlays 0 --out ";
  const auto outcome_of = [&](const std::string& rows) {
    folder_.write("odd/associations.txt", rows);
    fs::remove_all(folder_ / "of_odd");
    return run(call + quoted(folder_ / "of_odd"));
  };
  ASSERT_TRUE(fs::exists(odd / "rgb/1.033333.png")) << "the names of the images";
  const Outcome back = outcome_of(row("1.0", 0) + row("3.0", 2) + row("2.0", 1));
  ASSERT_EQ(back.exit_code, 0) << back.printed;
  const auto frames = read_csv(folder_ / "of_odd/frames.csv");
  ASSERT_EQ(frames.size(), 4U);
  for (std::size_t i = 2; i < frames.size(); ++i) EXPECT_LT(frames[i - 1][0], frames[i][0]);

  const Outcome repeated = outcome_of(row("1.0", 0) + row("1.0", 1) + row("2.0", 2));
  EXPECT_EQ(repeated.exit_code, 1);
  EXPECT_TRUE(repeated.mentions("associations.txt:")) << repeated.printed;
  EXPECT_FALSE(fs::exists(folder_ / "of_odd/summary.json"));

  const Outcome jump = outcome_of(row("1.0", 0) + row("2.0", 1) + row("8000000.0", 2));
  ASSERT_EQ(jump.exit_code, 0) << jump.printed;
  EXPECT_EQ(read_json(folder_ / "of_odd/summary.json")["frames"], 3);
}

}  // namespace
}  // namespace dynfilter::testing
