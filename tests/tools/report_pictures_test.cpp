// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a report says and shows of runs: the origin of their masks, reliability, the worst frames.

#include <cstddef>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "report/html_pictures.hpp"
#include "report/html_reliability.hpp"
#include "run_results.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::tools {
namespace {

using testing::TemporaryFolder;

TEST(MasksOrigin, IsUnknownForARuleThatTakesTheTrueOnes) {
  EXPECT_EQ(masks_origin("perfect", true, "yolo.onnx"), "");
  EXPECT_EQ(masks_origin("perfect", false, ""), "");
  EXPECT_EQ(masks_origin("depth", true, "yolo.onnx"), "the masks of yolo.onnx");
  EXPECT_EQ(masks_origin("depth", true, ""), "the scene's own masks");
  EXPECT_EQ(masks_origin("depth", false, ""), "no masks");
  EXPECT_EQ(masks_origin("a rule of another version", true, ""), "the scene's own masks");
}

/// A group with one run of rule depth, in that folder.
GroupOfRuns group_of_one(const std::filesystem::path& folder) {
  RunResult run;
  run.folder = folder;
  run.rule = "depth";
  run.scene.name = "hall";
  run.scores.emplace();
  return {"halls", {run}};
}

/// Plots rule depth with so many weights of 0.95 and of 0.25. Returns the points of its line.
std::string plotted(std::size_t certain, std::size_t doubtful) {
  GroupOfRuns group = group_of_one({});
  group.runs[0].reliability.emplace();
  for (std::size_t i = 0; i < certain; ++i) group.runs[0].reliability->all.add(0.95, true);
  for (std::size_t i = 0; i < doubtful; ++i) group.runs[0].reliability->all.add(0.25, true);
  const std::string page = reliability_plot(group, RuleStyles({"depth"}));
  const std::size_t points = page.find(" d=", page.rfind("class=\"line"));  // after the legend
  return page.substr(points, page.find('>', points) - points);
}

TEST(ReliabilityPlot, LeavesOutBinsOfFewerThanFiftyFeatures) {
  EXPECT_EQ(plotted(200, 49), plotted(200, 0));
  EXPECT_NE(plotted(200, 50), plotted(200, 0));
}

TEST(WorstFrames, ReducesWidePicturesInProportion) {
  const TemporaryFolder folder;
  folder.write("frames.csv", "timestamp_s,kept,dynamic_left,static_removed\n1,10,3,4\n");
  const auto size_of = [&](const cv::Size& size) {
    cv::imwrite((folder / "worst_frame.jpg").string(), cv::Mat(size, CV_8UC3, cv::Scalar(9)));
    Notes notes;
    const std::string page = worst_frames(group_of_one(folder / "."), notes);
    const std::size_t width = page.find("width=");
    return page.substr(width, page.find(" alt=") - width);
  };
  EXPECT_EQ(size_of({480, 300}), "width=\"480\" height=\"300\"");
  EXPECT_EQ(size_of({960, 600}), "width=\"480\" height=\"300\"");
  EXPECT_EQ(size_of({2000, 1}), "width=\"480\" height=\"1\"");
}

}  // namespace
}  // namespace dynfilter::tools
