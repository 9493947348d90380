// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a report says and shows of runs: the origin of their masks, the worst frames.

#include <cstddef>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "report/html_pictures.hpp"
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

TEST(WorstFrames, SayWhyARuleHasNone) {
  const TemporaryFolder folder;
  const auto notes_of = [&](int dynamic_left, bool has_scores) {
    folder.write("frames.csv", "timestamp_s,kept,dynamic_left,static_removed\n1,10," +
                                   std::to_string(dynamic_left) + ",4\n");
    cv::imwrite((folder / "worst_frame.jpg").string(), cv::Mat(8, 8, CV_8UC3, cv::Scalar(9)));
    GroupOfRuns group = group_of_one(folder / ".");
    if (!has_scores) group.runs[0].scores.reset();
    group.runs.push_back(group.runs[0]);
    group.runs[1].rule = "mask";
    Notes notes;
    const bool has_page = !worst_frames(group, notes).empty();
    EXPECT_EQ(has_page, notes.empty());
    return notes.empty() ? "" : notes[0];
  };
  EXPECT_EQ(notes_of(1, true), "");
  EXPECT_NE(notes_of(0, true).find("no dynamic features are left"), std::string::npos);
  EXPECT_NE(notes_of(1, false).find("true masks are unknown"), std::string::npos);
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
