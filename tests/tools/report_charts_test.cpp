// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Where a report's charts draw their values.

#include <string>

#include <gtest/gtest.h>

#include "report/html_chart.hpp"
#include "report/html_plots.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::tools {
namespace {

using testing::TemporaryFolder;

/// Returns the path of the first line of this class.
std::string path_of(const std::string& page, const std::string& line_class) {
  const std::string start = "<path class=\"" + line_class + "\" d=\"";
  const std::size_t at = page.rfind(start);
  if (at == std::string::npos) return "none in " + page;
  const std::size_t first = at + start.size();
  return page.substr(first, page.find('"', first) - first);
}

// The area is chart_width = 344 wide, with a margin of 3 at either end.

TEST(Chart, PlacesValuesInProportion) {
  Chart chart;
  chart.height = 206;
  chart.x = {"x", 10, 12, false};
  chart.y = {"y", -1, 3, false};
  chart.lines = {{"a", "line0", {{10, -1}, {11, 1}, {12, 3}, {11, 0}}}};
  EXPECT_EQ(path_of(svg_of(chart), "line0"), "M3 203L172 103L341 3L172 153");
}

TEST(Chart, PlacesValuesByTheirSquareRoots) {
  Chart chart;
  chart.height = 206;
  chart.y = {"y", 0, 100, true};
  chart.lines = {{"a", "line0", {{0, 0}, {0, 25}, {0, 100}, {0, -9}}}};
  EXPECT_EQ(path_of(svg_of(chart), "line0"), "M3 203L3 103L3 3L3 203");
}

/// A run whose trajectory is exact, in its folder.
RunResult run_in(const TemporaryFolder& folder, const std::string& trajectory) {
  folder.write("groundtruth.txt", trajectory);
  folder.write("trajectory.txt", trajectory);
  folder.write("frames.csv",
               "timestamp_s,kept,dynamic_left,static_removed\n1,9,4,7\n2,9,16,0\n3,9,1,0\n");
  RunResult run;
  run.folder = folder / ".";
  run.rule = "depth";
  run.scene.name = "hall";
  run.ate_rmse_m = 0;
  return run;
}

TEST(ScenePlots, ShowAllOfTheTrajectory) {
  const TemporaryFolder folder;
  // From (0, 0) by way of (4, 1) and (4, -1): 4 m in x and 2 m in y.
  const RunResult run = run_in(folder, "1 0 0 0 0 0 0 1\n2 4 1 0 0 0 0 1\n3 4 -1 0 0 0 0 1\n");
  Notes notes;
  const std::string page = scene_plots({run}, RuleStyles({"depth"}), notes);
  EXPECT_TRUE(notes.empty());
  // Both axes show 1.3 times the longer side, about the middle: x from -0.6 to 4.6 m.
  EXPECT_EQ(path_of(page, "truth"), "M42 172L302 107L302 237");
  EXPECT_EQ(page.find("Cut off"), std::string::npos);
}

TEST(ScenePlots, ScaleCountsToTheHighest) {
  const TemporaryFolder folder;
  RunResult run = run_in(folder, "");
  run.ate_rmse_m.reset();
  Notes notes;
  const std::string page = scene_plots({run}, RuleStyles({"depth"}), notes);
  // Static removed, the last plot: 7 of 10 (the next round number), and zeros; times of 0 to 2 s.
  EXPECT_EQ(path_of(page, "line line0"), "M3 34.7L172 197L341 197");
}

}  // namespace
}  // namespace dynfilter::tools
