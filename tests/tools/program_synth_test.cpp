// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// `dynfilter synth` from a user's view: run in a shell, judged by its output and files.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/program.hpp"
#include "support/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

class Synth : public SmallSceneTest {};

TEST_F(Synth, WritesSequenceMasksAndGroundTruth) {
  for (const char* name : {"camera.yaml", "rgb.txt", "depth.txt", "associations.txt",
                           "groundtruth.txt", "masks/instances.csv", "masks_true/instances.csv"}) {
    EXPECT_TRUE(fs::is_regular_file(scene() / name)) << name;
  }
}

TEST_F(Synth, ReplacesASceneOnlyOnRequest) {
  const std::string again = "synth " + quoted(out("twice")) + " --frames 2 --width 64 --height 48";
  EXPECT_EQ(run(again).exit_code, 0);
  const Outcome refused = run(again);
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_TRUE(refused.mentions("already")) << refused.printed;
  EXPECT_EQ(run(again + " --overwrite").exit_code, 0);
}

TEST_F(Synth, RendersALevelWithStaleMasks) {
  const std::string size = " --frames 3 --width 160 --height 120";
  ASSERT_EQ(run("synth " + quoted(out("level")) + " --level stale_3 --mask-age 0" + size).exit_code,
            0);
  ASSERT_EQ(run("synth " + quoted(out("old")) + " --level stale_3 --mask-age 2" + size).exit_code,
            0);
  // Frame 0's instances come first. Two frames later they still apply, under that frame's name.
  const auto fresh = read_csv(out("level") / "masks" / "instances.csv");
  const auto old = read_csv(out("old") / "masks" / "instances.csv");
  const auto of_frame = [](const auto& rows, const char* frame) {
    std::vector<std::vector<std::string>> found;
    for (auto row : rows) {
      if (row.at(0) != frame) continue;
      row.at(0).clear();
      row.resize(8);  // without mask_time
      found.push_back(row);
    }
    return found;
  };
  EXPECT_FALSE(of_frame(fresh, "1.000000").empty());
  EXPECT_EQ(of_frame(old, "1.066667"), of_frame(fresh, "1.000000"));
  EXPECT_NE(of_frame(fresh, "1.066667"), of_frame(fresh, "1.000000"));
  FrameView frame;
  frame.timestamp_s = 1.066667;
  EXPECT_DOUBLE_EQ(MaskFolderSegmenter(out("old") / "masks").segment(frame).timestamp_s, 1.0);
  EXPECT_DOUBLE_EQ(MaskFolderSegmenter(out("level") / "masks").segment(frame).timestamp_s,
                   1.066667);
  EXPECT_TRUE(run("synth " + quoted(out("x")) + " --level easy").mentions("medium"));
}

TEST_F(Synth, StatesTheLatenessOfDepth) {
  EXPECT_NE(read_text(scene() / "truth.yaml").find("\ndepth_late_s: 0\n"), std::string::npos);
  ASSERT_EQ(run("synth " + quoted(out("late")) +
                " --level depth_early_16 --frames 1 --width 64 --height 48")
                .exit_code,
            0);
  const cv::Mat moving =
      cv::imread((out("late") / "masks_moving/1.000000.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(moving.type(), CV_8UC1);
  EXPECT_EQ(moving.size(), cv::Size(64, 48));
  EXPECT_GT(cv::countNonZero(moving), 100);
  const std::string truth = read_text(out("late") / "truth.yaml");
  EXPECT_NE(truth.find("\ndepth_late_s: -0.016666"), std::string::npos) << truth;
}

TEST_F(Synth, ReportsStatisticsOfALevelWithoutAFolder) {
  const Outcome outcome =
      run("synth --statistics --level desk --frames 9 --width 160 --height 120");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("desk/masks_true")) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("depth is older than the masks by")) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("static features a frame")) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("static features off the true motion")) << outcome.printed;
  for (const char* command : {"synth", "synth --level desk", "synth --statistics"}) {
    const Outcome refused = run(command);
    EXPECT_NE(refused.exit_code, 0) << command;
    EXPECT_TRUE(refused.mentions("FOLDER")) << refused.printed;
  }
}

TEST_F(Synth, ReportsDepthStatistics) {
  const Outcome outcome = run("synth " + quoted(scene()) + " --statistics");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("depth missing, % of the image")) << outcome.printed;
  EXPECT_TRUE(run("synth " + quoted(out("nowhere")) + " --statistics").mentions("nowhere"));
}

}  // namespace
}  // namespace dynfilter::testing
