// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// `dynfilter ablate`: comparing rules in one process, or as jobs that run anywhere.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

constexpr const char* tiny = " --frames 4 --width 160 --height 120 --features 200";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Exit code of a shell command.
int shell(const std::string& command) { return std::system(("(" + command + ") 2>&1").c_str()); }

/// Sweep of two levels and two seeds under three rules, run once in one process.
class Ablate : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder();
    outcome_ = new Outcome(run("ablate" + sweep() + " --out " + quoted(out("one process"))));
    ASSERT_EQ(outcome_->exit_code, 0) << outcome_->printed;
  }
  static void TearDownTestSuite() {
    delete outcome_;
    delete folder_;
    outcome_ = nullptr;
    folder_ = nullptr;
  }

  static std::string sweep() {
    return std::string(" --levels medium,static --seeds 1-2 --rules mask,paper,perfect") + tiny;
  }
  static const std::string& printed() { return outcome_->printed; }
  static fs::path out(const char* name) { return folder_->path() / name; }

  /// Copy of the results, for a test to modify.
  static fs::path copy(const char* name) {
    fs::copy(out("one process"), out(name), fs::copy_options::recursive);
    return out(name);
  }

  /// Jobs of the sweep with their results in that folder.
  static std::vector<std::string> jobs(const char* name) {
    return lines_of(run("ablate" + sweep() + " --list --out " + quoted(out(name))).printed);
  }

 private:
  static TemporaryFolder* folder_;
  static Outcome* outcome_;
};

TemporaryFolder* Ablate::folder_ = nullptr;
Outcome* Ablate::outcome_ = nullptr;

TEST_F(Ablate, PrintsTheTablesOfEveryGroup) {
  for (const char* title :
       {"static, 2 scenes: features a frame", "medium, 2 scenes: features a frame",
        "medium, 2 scenes: dynamic = silhouette | silhouette and rim",
        "medium, 2 scenes: the odometry's RMSE", "in the form of the paper's Table 4"}) {
    EXPECT_NE(printed().find(title), std::string::npos) << title << '\n' << printed();
  }
  EXPECT_EQ(printed().find("missing"), std::string::npos) << printed();
}

TEST_F(Ablate, KeepsTheResultsAndOptionsOfEveryRun) {
  for (const char* job : {"medium_1/mask", "medium_2/paper", "static_1/perfect"}) {
    const fs::path folder = out("one process") / job;
    for (const char* file :
         {"summary.json", "frames.csv", "instances.csv", "trajectory.txt", "groundtruth.txt"}) {
      EXPECT_TRUE(fs::is_regular_file(folder / file)) << folder / file;
    }
    EXPECT_EQ(read_json(folder / "summary.json")["options"]["features"], "200");
  }
  const nlohmann::json summary = read_json(out("one process") / "medium_2/paper/summary.json");
  EXPECT_EQ(summary["input"], "--level medium --scene-seed 2 --frames 4 --width 160 --height 120");
}

TEST_F(Ablate, MedianOfTwoScenesLiesBetweenTheirValues) {
  double left[2];
  for (const int seed : {1, 2}) {
    const fs::path folder = out("one process") / ("medium_" + std::to_string(seed)) / "mask";
    left[seed - 1] = read_json(folder / "summary.json")["dynamic_left"].get<double>() / 4;
  }
  char cell[64];
  std::snprintf(cell, sizeof cell, "%.1f (%.1f..%.1f)", (left[0] + left[1]) / 2,
                std::min(left[0], left[1]), std::max(left[0], left[1]));
  EXPECT_NE(printed().find(cell), std::string::npos) << cell << '\n' << printed();
}

TEST_F(Ablate, SingleRunGivesTheSameFigures) {
  std::string input;
  const nlohmann::json together = read_json(out("one process") / "medium_1/paper/summary.json");
  together["input"].get_to(input);
  const Outcome alone = run("run " + input + " --rule paper --features 200 --overlays 0 --out " +
                            quoted(out("alone")));
  ASSERT_EQ(alone.exit_code, 0) << alone.printed;
  nlohmann::json summary = read_json(out("alone") / "summary.json");
  for (const char* name : {"scene", "masked", "compensated", "kept", "dynamic_left", "rim_removed",
                           "static_removed", "ate_rmse_m", "options"}) {
    EXPECT_EQ(summary[name], together[name]) << name;
  }
}

TEST_F(Ablate, ListsOneJobForEachSceneAndRule) {
  const std::vector<std::string> list = jobs("listed");
  ASSERT_EQ(list.size(), 12U);
  for (const std::string& line : list) {
    EXPECT_NE(line.find(" run --level "), std::string::npos) << line;
    EXPECT_NE(line.find("--rule "), std::string::npos) << line;
  }
  EXPECT_FALSE(fs::exists(out("listed"))) << "--list runs nothing";
}

TEST_F(Ablate, TablesDoNotDependOnJobOrderOrRepetition) {
  std::vector<std::string> list = jobs("in jobs");
  ASSERT_EQ(list.size(), 12U);
  for (std::size_t i = list.size(); i-- > 0;) EXPECT_EQ(shell(list[i] + " >/dev/null"), 0);
  EXPECT_EQ(shell(list[3] + " >/dev/null"), 0);
  fs::copy(out("in jobs") / "medium_1", out("in jobs") / "from another machine",
           fs::copy_options::recursive);
  EXPECT_EQ(run("ablate --gather " + quoted(out("in jobs"))).printed, printed());
}

TEST_F(Ablate, XargsRunsTheListInParallel) {
  const std::string command = "'" DYNFILTER_PROGRAM "' ablate" + sweep() + " --list --out " +
                              quoted(out("in parallel")) +
                              " | xargs -d '\\n' -P 2 -n 1 sh -c >/dev/null";
  ASSERT_EQ(shell(command), 0);
  EXPECT_EQ(run("ablate --gather " + quoted(out("in parallel"))).printed, printed());
}

TEST_F(Ablate, GatherNamesMissingResults) {
  const fs::path folder = copy("one missing");
  fs::remove_all(folder / "medium_2" / "paper");
  const Outcome outcome = run("ablate --gather " + quoted(folder));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("missing: medium_2 under paper\n")) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("paper [1]")) << "one of two scenes: " << outcome.printed;
}

TEST_F(Ablate, InterruptedJobCountsAsMissing) {
  const fs::path folder = copy("cut off");
  fs::rename(folder / "static_1" / "mask" / "summary.json",
             folder / "static_1" / "mask" / "summary.json.123");
  std::ofstream(folder / "static_1" / "paper" / ".dynfilter-commit") << "run\n";
  const Outcome outcome = run("ablate --gather " + quoted(folder));
  EXPECT_TRUE(outcome.mentions("missing: static_1 under mask\n")) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("missing: static_1 under paper\n")) << outcome.printed;
}

TEST_F(Ablate, RefusesToMixDifferentResults) {
  const fs::path folder = copy("mixed");
  const std::string paper = "run --level medium --scene-seed 1 --rule paper" + std::string(tiny);
  ASSERT_EQ(run(paper + " --seed 7 --out " + quoted(folder / "other")).exit_code, 0);
  const Outcome options = run("ablate --gather " + quoted(folder));
  EXPECT_NE(options.exit_code, 0);
  EXPECT_TRUE(options.mentions("seed 7")) << options.printed;

  const fs::path changed = copy("changed");
  nlohmann::json summary = read_json(changed / "medium_1/mask/summary.json");
  summary["dynamic_left"] = summary["dynamic_left"].get<int>() + 1;
  fs::create_directories(changed / "twice");
  std::ofstream(changed / "twice" / "summary.json") << summary;
  const Outcome figures = run("ablate --gather " + quoted(changed));
  EXPECT_NE(figures.exit_code, 0);
  EXPECT_TRUE(figures.mentions("medium_1 under rule mask")) << figures.printed;
}

TEST_F(Ablate, RefusesToMixDifferentScenes) {
  const std::string medium = "ablate --levels medium --seeds 1 --features 200 --out " +
                             quoted(out("two sizes")) + " --height 120 --frames ";
  ASSERT_EQ(run(medium + "4 --width 160 --rules none").exit_code, 0);
  for (const char* other : {"6 --width 160", "4 --width 176"}) {
    const Outcome outcome = run(medium + other + " --rules mask");
    EXPECT_NE(outcome.exit_code, 0);
    EXPECT_TRUE(outcome.mentions("medium_1/none")) << outcome.printed;
    EXPECT_TRUE(outcome.mentions("medium_1/mask")) << outcome.printed;
    EXPECT_FALSE(fs::exists(out("two sizes") / "medium_1/mask")) << "no job may start";
  }
  EXPECT_EQ(run(medium + "4 --width 160 --rules mask,perfect").exit_code, 0);

  const fs::path folder = copy("two inputs");
  for (const char* changed : {R"({"input": "elsewhere"})", R"({"image_size": [32, 24]})",
                              R"({"has_masks": false})", R"({"segmenter": "a network"})"}) {
    nlohmann::json summary = read_json(folder / "medium_1/mask/summary.json");
    summary.update(nlohmann::json::parse(changed));
    summary["rule"] = "paper";
    std::ofstream(folder / "medium_1/paper/summary.json") << summary;
    const Outcome outcome = run("ablate --gather " + quoted(folder));
    EXPECT_NE(outcome.exit_code, 0) << changed;
    EXPECT_TRUE(outcome.mentions("medium_1/mask")) << outcome.printed;
    EXPECT_TRUE(outcome.mentions("medium_1/paper")) << outcome.printed;
  }
}

TEST_F(Ablate, FindsObstaclesBeforeTheFirstJob) {
  const std::string command = "ablate --levels medium --seeds 1" + std::string(tiny) + " --out " +
                              quoted(out("late")) + " --rules ";
  ASSERT_EQ(run(command + "none").exit_code, 0);
  const Outcome options = run(command + "mask --seed 7");
  EXPECT_NE(options.exit_code, 0);
  EXPECT_TRUE(options.mentions("late/medium_1/none")) << options.printed;
  EXPECT_FALSE(fs::exists(out("late") / "medium_1/mask"));
  EXPECT_EQ(run(command + "none --seed 7").exit_code, 0) << "all earlier results are replaced";
}

/// Writes a result with the given figures.
void write_result(const fs::path& folder, int scene, const std::string& rule, double ate_rmse_m,
                  const std::string& group = "made") {
  const nlohmann::json summary = {{"group", group},
                                  {"scene", group + "_" + std::to_string(scene)},
                                  {"rule", rule},
                                  {"options", nlohmann::json::object()},
                                  {"frames", 10},
                                  {"features", 1000},
                                  {"kept", 500},
                                  {"lost_frames", scene},
                                  {"ate_rmse_m", ate_rmse_m}};
  const fs::path job = folder / (group + std::to_string(scene) + rule);
  fs::create_directories(job);
  std::ofstream(job / "summary.json") << summary;
}

TEST_F(Ablate, FiguresMatchHandComputedValues) {
  const fs::path folder = out("by hand");
  const double errors[][3] = {{0.4, 0.1, 0.1}, {1.2, 0.3, 0.2}, {0.6, 0.6, 0.1}};
  for (int scene = 0; scene < 3; ++scene) {
    write_result(folder, scene, "mask", errors[scene][0]);
    write_result(folder, scene, "paper", errors[scene][1]);
    write_result(folder, scene, "perfect", errors[scene][2]);
  }
  const Outcome outcome = run("ablate --gather " + quoted(folder));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  // Relative to the perfect mask: 4, 6 and 6; 1, 1.5 and 6. The median of three resampled values is
  // the minimum or the maximum in 7 of 27 cases each, so the interval spans all three.
  for (const char* cells : {"0.6000 (0.4000..1.2000)", "6.00 [4.00..6.00]", "1.50 [1.00..6.00]",
                            "10.0 (0.0..20.0)", "0.6000  0.3000       50.0 %"}) {
    EXPECT_TRUE(outcome.mentions(cells)) << cells << '\n' << outcome.printed;
  }
}

TEST_F(Ablate, TellsTheFramesTrackedBesideTheError) {
  const fs::path folder = out("tracked");
  for (int scene = 0; scene < 3; ++scene) {  // as many frames of ten are lost
    write_result(folder, scene, "mask", 0.1 * (scene + 1), "a");
    write_result(folder, scene, "perfect", 0.1, "a");
    write_result(folder, scene + 6, "mask", 0.4, "b");
  }
  const Outcome outcome = run("ablate --gather " + quoted(folder));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("mask     0.2000 / 90  0.4000 / 30\n")) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("mask     2.00 [1.00..3.00] at 90 %  -\n")) << outcome.printed;
}

TEST_F(Ablate, RefusesFoldersWithoutResults) {
  EXPECT_TRUE(run("ablate --gather /nowhere").mentions("/nowhere"));
  fs::create_directories(out("empty"));
  EXPECT_TRUE(run("ablate --gather " + quoted(out("empty"))).mentions("no summary.json"));
  fs::create_directories(out("foreign"));
  std::ofstream(out("foreign") / "summary.json") << "{\"frames\": 3}";
  const Outcome foreign = run("ablate --gather " + quoted(out("foreign")));
  EXPECT_NE(foreign.exit_code, 0);
  EXPECT_TRUE(foreign.mentions("foreign/summary.json")) << foreign.printed;
  fs::remove(out("foreign") / "summary.json");
  ASSERT_EQ(mkfifo((out("foreign") / "summary.json").c_str(), 0600), 0);
  const Outcome pipe = run_at_most(10, "ablate --gather " + quoted(out("foreign")));
  EXPECT_TRUE(pipe.mentions("summary.json: is not a regular file")) << pipe.printed;
  EXPECT_TRUE(run("ablate " + quoted(out("empty"))).mentions("rgb.txt"));
}

TEST_F(Ablate, RefusesInvalidPlans) {
  const auto refuses = [](const std::string& arguments, const char* what) {
    const Outcome outcome = run("ablate " + arguments);
    EXPECT_NE(outcome.exit_code, 0) << arguments;
    EXPECT_TRUE(outcome.mentions(what)) << outcome.printed;
  };
  refuses("", "SEQUENCE");
  refuses("--levels easy", "medium");
  refuses("--levels easy_depth_late", "medium");
  refuses("--levels medium --rules best", "crowd_slam");
  for (const char* seeds : {"5-1", "a", "1-", "-1", "1,,2", "1.5", "1-2-3", ""}) {
    refuses("--levels medium --list --seeds '" + std::string(seeds) + "'", "--seeds");
  }
  refuses("--levels medium,medium --list", "two scenes named medium_1");
  refuses("--levels medium --gather x --list", "excludes");
  refuses("--levels medium --masks x", "--masks and --camera need one SEQUENCE");
  refuses("one two --camera x", "--masks and --camera need one SEQUENCE");
}

TEST_F(Ablate, TakesOtherMasksAndAnotherCameraOfASequence) {
  const fs::path scene = out("with other masks");
  ASSERT_EQ(run("synth " + quoted(scene) + " --frames 3 --width 160 --height 120").exit_code, 0);
  const std::string files =
      " --masks " + quoted(scene / "masks_true") + " --camera " + quoted(out("other.yaml"));
  fs::rename(scene / "camera.yaml", out("other.yaml"));
  const Outcome listed = run("ablate " + quoted(scene) + files + " --rules mask --list");
  EXPECT_TRUE(listed.mentions(" --masks " + quoted(scene / "masks_true"))) << listed.printed;
  EXPECT_TRUE(listed.mentions(" --camera " + out("other.yaml").string())) << listed.printed;
  const Outcome outcome =
      run("ablate " + quoted(scene) + files + " --rules mask --out " + quoted(out("of others")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  const nlohmann::json summary =
      read_json(out("of others") / "with other masks" / "mask" / "summary.json");
  EXPECT_EQ(summary["dynamic_left"], 0) << "the masks are the true ones";
}

TEST_F(Ablate, TakesEveryLevelWithLateDepth) {
  const Outcome outcome = run(
      "ablate --levels medium,medium_depth_late,crowd_depth_late --seeds 7 --rules mask --list");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("--level medium_depth_late --scene-seed 7")) << outcome.printed;
}

TEST_F(Ablate, OmitsPerfectMasksWithoutTruth) {
  const fs::path recorded = out("recorded");
  ASSERT_EQ(run("synth " + quoted(recorded) + " --frames 3 --width 160 --height 120").exit_code, 0);
  fs::remove_all(recorded / "masks_true");
  const Outcome outcome = run("ablate " + quoted(recorded) + " --rules mask,perfect --out " +
                              quoted(out("of recording")));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_FALSE(outcome.mentions("perfect ")) << outcome.printed;
  const Outcome alone = run("run " + quoted(recorded) + " --rule perfect");
  EXPECT_NE(alone.exit_code, 0);
  EXPECT_TRUE(alone.mentions("masks_true")) << alone.printed;
}

}  // namespace
}  // namespace dynfilter::testing
