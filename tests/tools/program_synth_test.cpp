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
  const cv::Mat moving =
      cv::imread((scene() / "masks_moving/1.000000.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(moving.type(), CV_8UC1);
  EXPECT_EQ(moving.size(), cv::Size(320, 240));
  EXPECT_GT(cv::countNonZero(moving), 1000);
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
  ASSERT_EQ(
      run("synth " + quoted(out("stale")) + " --level stale_3 --frames 5 --width 160 --height 120")
          .exit_code,
      0);
  FrameView frame;
  frame.timestamp_s = 1.133333;  // the last one
  EXPECT_DOUBLE_EQ(MaskFolderSegmenter(out("stale") / "masks").segment(frame).timestamp_s,
                   1.033333);
  EXPECT_TRUE(run("synth " + quoted(out("x")) + " --level easy").mentions("medium"));
}

}  // namespace
}  // namespace dynfilter::testing
