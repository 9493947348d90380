// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// `dynfilter ablate`, its tables, and examples/report.py, which draws its results.

#include <array>
#include <cstdio>
#include <regex>
#include <sstream>
#include <utility>

#include "dynfilter/version.hpp"
#include "support/test.hpp"
#include "tools/program.hpp"
#include "tools/rule_set.hpp"
#include "tools/run_record.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

constexpr const char* tiny = " --frames 4 --width 160 --height 120 --features 200";

/// A sweep of two levels and two seeds under three rules, run once.
class Ablate : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    outcome_ = succeed("ablate --levels static,medium --seeds 1-2 --rules perfect,paper,mask" +
                       std::string(tiny) + " --out " + quoted(out("sweep")));
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static const std::string& printed() { return outcome_.printed; }
  static fs::path out(const char* name) { return folder_->path() / name; }
  static nlohmann::json summary(const std::string& job) {
    return read_json(out("sweep") / job / "summary.json");
  }

 private:
  static inline std::optional<TemporaryFolder> folder_;
  static inline Outcome outcome_;
};

TEST_F(Ablate, PrintsTheTablesOfEveryGroup) {
  EXPECT_EQ(printed().find('\r'), std::string::npos) << "progress is for terminals";
  EXPECT_NE(printed().find("\nwritten to "), std::string::npos);
  for (const char* title :
       {"all: dynamic left/static removed a frame (in a worst frame of a hundred)",
        "all: RMSE of the ATE in m/frames tracked in %/features kept at the fewest",
        "all: ATE over that of rule mask", "in the form of the paper's Table 1 and 4"}) {
    EXPECT_NE(printed().find(title), std::string::npos) << title << '\n' << printed();
  }
  double left = 0, fewest = 0;
  for (const int seed : {1, 2}) {
    const auto mask = summary("medium_" + std::to_string(seed) + "/mask");
    left += mask["dynamic_left"].get<double>() / 4 / 2;
    fewest += mask["fewest_kept"].get<double>() / 2;
  }
  char cell[64];
  std::snprintf(cell, sizeof cell, "/%.0f", fewest);
  EXPECT_NE(printed().find(cell), std::string::npos) << cell << '\n' << printed();
  std::snprintf(cell, sizeof cell, " %.1f/", left);
  EXPECT_NE(printed().find(cell), std::string::npos) << cell << '\n' << printed();
}

TEST_F(Ablate, ASingleRunGivesTheSameFigures) {
  for (const char* file : {"summary.json", "frames.csv", "trajectory.txt", "groundtruth.txt"}) {
    EXPECT_TRUE(fs::is_regular_file(out("sweep") / "static_1/perfect" / file)) << file;
  }
  const nlohmann::json together = summary("medium_1/paper");
  const Outcome alone = succeed("run --level medium --scene-seed 1" + std::string(tiny) +
                                " --rule paper --overlays 0 --out " + quoted(out("alone")));
  const nlohmann::json figures = read_json(out("alone") / "summary.json");
  for (const char* name :
       {"scene", "masked", "compensated", "kept", "fewest_kept", "cautious_frames", "dynamic_left",
        "static_removed", "ate_rmse_m", "options"}) {
    EXPECT_EQ(figures[name], together[name]) << name;
  }
}

TEST_F(Ablate, ReportDrawsTheResults) {
  if (run_in_shell("python3 -c 'import matplotlib'").exit_code != 0) {
    GTEST_SKIP() << "there is no python3-matplotlib";
  }
  const std::string report = "python3 '" DYNFILTER_SOURCE_DIR "/examples/report.py' ";
  const Outcome outcome =
      run_in_shell(report + quoted(out("sweep")) + " " + quoted(out("page.html")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  expect_mentions(outcome, "4 runs of each rule in 2 groups");
  const std::string page = file_text(out("page.html"));
  for (const char* part :
       {"<h2>medium, medians over 2 runs", "<h3>The camera's path</h3><img",
        "<h3>Over time</h3><img", "<b>mask</b>: 1.", "image/svg+xml",
        "<p>dynfilter " DYNFILTER_VERSION_STRING ", features 200", "<td>mask</td><td>",
        "<h3>The worst frames</h3><div class=\"row\"><figure><img alt=\"\" "
        "src=\"data:image/jpeg"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(page.find("src=\"h"), std::string::npos) << "one file holds all";
  fs::create_directories(out("empty"));
  const Outcome none = run_in_shell(report + quoted(out("empty")) + " " + quoted(out("no.html")));
  EXPECT_NE(none.exit_code, 0);
  expect_mentions(none, "holds no results");
}

TEST_F(Ablate, RefusesInvalidPlans) {
  const auto refuses = [](const std::string& arguments, const char* what) {
    expect_refused("ablate " + arguments, what);
  };
  refuses("", "SEQUENCE");
  refuses("--levels easy", "medium");
  refuses("--levels medium --rules best", "crowd_slam");
  for (const char* seeds : {"5-1", "a", "1-", "-1", "1,,2", "1.5", "1-2-3", "", "0-10000",
                            "1-9999,10001,10002", "18446744073709551616"}) {
    refuses("--levels medium --seeds '" + std::string(seeds) + "'", "--seeds");
  }
  refuses("--levels medium,medium", "two scenes named medium_1");
  refuses("one two --masks x", "--masks needs one SEQUENCE");
  refuses("--levels medium --features 500,0", "--features");
  refuses("--levels medium --features 500,500", "two scenes named medium_1_500");
  fs::create_directories(out("empty"));
  refuses(quoted(out("empty")), "rgb.txt");
}

TEST_F(Ablate, TakesOtherMasksAndAnotherCameraOfASequence) {
  const fs::path scene = out("with other masks");
  succeed("synth " + quoted(scene) + " --frames 3 --width 160 --height 120");
  fs::rename(scene / "camera.yaml", out("other.yaml"));
  succeed("ablate " + quoted(scene) + " --masks " + quoted(scene / "masks_true") + " --camera " +
          quoted(out("other.yaml")) + " --rules mask --out " + quoted(out("of others")));
  EXPECT_EQ(read_json(out("of others") / "with other masks/mask/summary.json")["dynamic_left"], 0)
      << "the masks are the true ones";
}

TEST_F(Ablate, OmitsPerfectMasksWithoutTruth) {
  const fs::path recorded = out("recorded");
  succeed("synth " + quoted(recorded) + " --frames 3 --width 160 --height 120");
  fs::remove_all(recorded / "masks_true");
  const Outcome outcome = succeed("ablate " + quoted(recorded) + " --rules mask,perfect --out " +
                                  quoted(out("of recording")));
  EXPECT_FALSE(outcome.mentions("perfect ")) << outcome.printed;
  expect_refused("run " + quoted(recorded) + " --rule perfect", "masks_true");
  expect_refused("ablate " + quoted(recorded) + " --rules perfect", "masks_true");
  fs::create_directories(out("of others"));
  fs::copy(recorded / "masks/1.000000.png", out("of others") / "900.5.png");
  expect_mentions(
      succeed("ablate " + quoted(recorded) + " --masks " + quoted(out("of others")) +
              " --missing-masks keep --degrade cut --rules mask --out " + quoted(out("of nobody"))),
      "3 of 3 frames have no mask");
  fs::create_directories(out("photos"));
  fs::copy(recorded / "rgb", out("photos"));
  expect_refused("ablate " + quoted(recorded) + " " + quoted(out("photos")) +
                     " --rules motion --out " + quoted(out("early")),
                 "rule motion needs depth, which photos does not have");
  EXPECT_FALSE(fs::exists(out("early"))) << "it must fail before the first scene";
}

/// Returns a run over ten frames, of which `scene` were lost.
tools::RunRecord result(const std::string& group, std::size_t scene, const std::string& rule,
                        double ate_rmse_m) {
  tools::RunRecord run;
  const std::string name = group + "_" + std::to_string(scene);
  run.scene = {group, name, name};
  run.rule = tools::rule_info(rule);
  run.frames.resize(10);
  for (std::size_t i = 0; i < scene; ++i) run.frames[i].is_lost = true;
  run.trajectory.emplace().ate_m.emplace().rmse = ate_rmse_m;
  return run;
}

std::string tables_text(const std::vector<tools::RunRecord>& results) {
  return tools::ablation_tables(results, tools::Truth::by_class);
}

TEST(AblationTables, MatchHandComputedValues) {
  const double errors[][3] = {{0.4, 0.1, 0.1}, {1.2, 0.3, 0.2}, {0.6, 0.6, 0.1}};
  std::vector<tools::RunRecord> results;
  for (const std::size_t scene : {0U, 1U, 2U}) {
    results.push_back(result("made", scene, "mask", errors[scene][0]));
    results.push_back(result("made", scene, "paper", errors[scene][1]));
    results.push_back(result("made", scene, "perfect", errors[scene][2]));
  }
  // Relative to masks alone: 1/4, 1/4 and 1.
  const std::string text = tables_text(results);
  for (const char* cells :
       {"mask     0.6000/90/0", "0.25 (0.25..1.00)",
        "0.6000 (0.4000..1.2000)              -  0.3000 (0.1000..0.6000)", "too few runs"}) {
    EXPECT_NE(text.find(cells), std::string::npos) << cells << '\n' << text;
  }
}

/// Returns the row of a group in the table with this title.
std::string row_of(const std::string& text, const std::string& title, const std::string& group) {
  const std::size_t table = text.find(title);
  if (table == std::string::npos) return "no table " + title;
  const std::size_t row = text.find('\n' + group + ' ', table) + 1;
  return text.substr(row, text.find('\n', row) - row);
}

TEST(AblationTables, ConcludeOnlyBeyondTheSpread) {
  const std::pair<const char*, std::array<double, 4>> runs[] = {
      {"none", {0.5, 0.6, 0.7, 0.8}},             // above all others
      {"mask", {0.11, 0.12, 0.13, 0.14}},         // meets the next two
      {"paper_depth", {0.10, 0.11, 0.12, 0.13}},  // meets the next one
      {"paper", {0.10, 0.10, 0.10, 0.13}},        // is better, but for one run
      {"depth_motion", {0.04, 0.05, 0.05, 0.06}}};
  std::vector<tools::RunRecord> results;
  for (const auto& [rule, errors] : runs) {
    for (std::size_t scene = 0; scene < 4; ++scene) {
      results.push_back(result("made", scene, rule, errors[scene]));
    }
  }
  std::istringstream cells(row_of(tables_text(results), "eq. (2)", "made"));
  std::string row;
  for (std::string word; cells >> word;) row += word + ' ';
  // 1 - 0.05 / 0.65, 1 - 0.10 / 0.65 and 1 - 0.05 / 0.10.
  EXPECT_EQ(row,
            "made 92.3 % 84.6 % within the spread within the spread within the spread 50.0 % ");
  for (tools::RunRecord& run : results) {
    if (run.rule.name != "depth_motion") continue;
    for (tools::FrameRecord& frame : run.frames) frame.is_lost = true;
  }
  EXPECT_TRUE(std::regex_search(row_of(tables_text(results), "eq. (2)", "made"),
                                std::regex("^made +other frames")))
      << "no error of a few frames is compared with one of all\n"
      << tables_text(results);
}

TEST_F(Ablate, ConcludesOfAShortSceneWhatItsSpreadAllows) {
  const Outcome outcome = succeed(
      "ablate --levels medium --seeds 1 --features 200,220,240,260 --frames 20 --width 160 "
      "--height 120 --rules none,mask,paper_depth,paper,depth_motion --out " +
      quoted(out("four")));
  EXPECT_TRUE(std::regex_search(row_of(outcome.printed, "eq. (2)", "medium"),
                                std::regex("^medium +[1-9][0-9.]+ % .*within the spread")))
      << outcome.printed;
  const auto figures = read_json(out("four") / "medium_1_220/paper/summary.json");
  EXPECT_EQ(figures["options"]["features"], 220);
  EXPECT_EQ(figures["group"], "medium");
  EXPECT_EQ(outcome.printed.find("Table 2"), std::string::npos) << "it lasts less than a second";
}

TEST(AblationTables, TellWhatEachStepRemoved) {
  std::vector<tools::RunRecord> results;
  for (const char* rule : {"mask", "paper", "depth_motion"}) {
    tools::RunRecord& run = results.emplace_back(result("made", 1, rule, 0.1));
    for (tools::FrameRecord& frame : run.frames) frame.statistics.masked = 20;
    run.frames[0].statistics.compensated = run.rule.compensates() ? 15 : 0;
    run.frames[0].statistics.full_code_ranges = run.rule.name == "paper" ? 1 : 0;
    run.frames[1].statistics.moving = run.rule.follows_motion() ? 7 : 0;
  }
  EXPECT_EQ(row_of(tables_text(results), "removed a frame on masks", "made"),
            "made      -  20.0/0.0/0.0/0.00/90              -  20.0/1.5/0.0/0.10/90  "
            "20.0/1.5/0.7/0.00/90");
}

TEST(AblationTables, TellTheFramesTrackedBesideTheError) {
  std::vector<tools::RunRecord> results;
  for (const std::size_t scene : {0U, 1U, 2U}) {
    results.push_back(result("a", scene, "mask", 0.1 * static_cast<double>(scene + 1)));
    results.push_back(result("a", scene, "perfect", 0.2 * static_cast<double>(scene + 1)));
    results.push_back(result("b", scene + 6, "mask", 0.4));
  }
  results.pop_back();
  const std::string text = tables_text(results);
  for (const char* cells : {"mask     0.2000/90/0  0.4000/35/0\n", "perfect  2.00 (2.00..2.00)"}) {
    EXPECT_NE(text.find(cells), std::string::npos) << cells << '\n' << text;
  }
}

TEST(AblationTables, TellNothingOfAnOdometryThatDidNotRun) {
  std::vector<tools::RunRecord> results = {result("a", 0, "mask", 0.1), result("b", 0, "mask", 0)};
  results[1].trajectory.reset();
  EXPECT_NE(tables_text(results).find("mask  0.1000/100/0  -/-/0\n"), std::string::npos)
      << tables_text(results);
}

// --- Rules that compare frames -------------------------------------------------------------------

const std::vector<std::string> frame_rules = {"motion", "depth_motion", "mask"};

TEST(FrameRules, ScenesOfASweepDoNotTouchEachOther) {
  const TemporaryFolder folder;
  const fs::path both = folder.path() / "both", alone = folder.path() / "alone";
  const std::string cross =
      "ablate --levels cross --frames 14 --width 160 --height 120 --features 200 --rules " +
      frame_rules[0] + ',' + frame_rules[1] + ',' + frame_rules[2];
  succeed(cross + " --seeds 1-2 --out " + quoted(both));
  succeed(cross + " --seeds 2 --out " + quoted(alone));
  for (const std::string& rule : frame_rules) {
    const auto read = [&](const fs::path& out) {
      return read_json(out / "cross_2" / rule / "summary.json");
    };
    const nlohmann::json together = read(both), one = read(alone);
    for (const char* name : {"moving", "custom", "kept", "dynamic_left", "static_removed"}) {
      EXPECT_EQ(together[name], one[name]) << rule << ' ' << name;
    }
  }
  const auto figures = [&](const char* rule) {
    return read_json(alone / "cross_2" / rule / "summary.json");
  };
  for (const std::string name : {"dynamic_left", "static_removed"}) {
    EXPECT_EQ(figures("depth_motion")[name + "_mask_only"], figures("mask")[name]) << name;
  }
}

}  // namespace
}  // namespace dynfilter::testing
