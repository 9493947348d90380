// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What dynfilter run says about good input, and where a run stops. program_doors_test.cpp has what
// is wrong; segmenters/input_checks_test.cpp tests the checks one by one.

#include "support/test.hpp"
#include "tools/changed_scene.hpp"
#include "tools/program.hpp"

namespace dynfilter::testing {
namespace {

TEST(ProgramChecks, StopARunAfterThirtyFramesIfNothingCanComeOfIt) {
  const TemporaryFolder folder;
  const fs::path scene = folder.path() / "scene", out = folder.path() / "out";
  succeed("synth " + quoted(scene) + " --frames 31 --width 160 --height 120");
  set_camera(scene, "DepthMapFactor", "DepthMapFactor: 1");
  for (const std::string command :
       {"run --features 200 ", "ablate --features 200 --rules none,mask ",
        "masks --format colmap --refine "}) {
    const Outcome outcome = run(command + quoted(scene) + " --out " + quoted(out));
    EXPECT_EQ(outcome.exit_code, 1) << outcome.printed;
    expect_mentions(outcome, "depth_unit: ");
    expect_mentions(outcome, "(stopped after 30 frames; nothing was written)");
    EXPECT_FALSE(fs::exists(out / "summary.json"));
  }
  expect_mentions(succeed("run " + quoted(scene) + " --every 2 --out " + quoted(out)),
                  "depth_unit: ");
}

/// Returns what a run says of its input.
std::string said(const std::string& arguments) {
  const TemporaryFolder folder;
  const Outcome outcome =
      succeed("run " + arguments + " --overlays 0 --out " + quoted(folder / "out"));
  const std::size_t at = outcome.printed.find("\nchecks of the input");
  if (at == std::string::npos) return outcome.printed;
  const std::string rest = outcome.printed.substr(at);
  return rest.substr(0, rest.find("\n\nwritten to"));
}

std::string said_of_level(const std::string& level, const std::string& more = "") {
  return said("--level " + level + " --scene-seed 11 --frames 16 --width 320 --height 240 " + more);
}

constexpr const char* silence = "\nchecks of the input: nothing to mend";

TEST(ProgramChecks, AreSilentAboutGoodLevels) {
  for (const char* level : {"static", "medium"}) EXPECT_EQ(said_of_level(level), silence);
  EXPECT_EQ(said_of_level("medium", "--rule dynaslam"), silence);
}

TEST(ProgramChecks, AreSilentAboutOtherLevelsSlow) {
  for (const char* level : {"cross", "together", "hard", "furniture", "two_in_one", "desk",
                            "near_crowd", "sitting", "crowd", "working", "stop_and_go", "pushed",
                            "carried", "still_camera", "rotation", "fast"}) {
    EXPECT_EQ(said("--frames 40 --scene-seed 5 --level " + std::string(level)), silence) << level;
  }
}

/// Edges of hair look as if depth were early.
TEST(ProgramChecks, AreSilentAboutHair) {
  EXPECT_EQ(said("--frames 24 --scene-seed 5 --level hair"), silence);
}

TEST(ProgramChecks, NameStaleMasksUnlessTheyAreMoved) {
  EXPECT_NE(said_of_level("stale_3").find("* masks_age: masks are 0.1 s old"), std::string::npos);
  EXPECT_EQ(said_of_level("stale_3", "--rule depth_moved"), silence);
}

TEST(ProgramChecks, AdviceOnFeaturesHelps) {
  const std::string starved = said_of_level("medium", "--features 300");
  const std::size_t at = starved.find("set --features to ");
  ASSERT_NE(at, std::string::npos) << starved;
  const std::string more = std::to_string(std::stoi(starved.substr(at + 18)));
  EXPECT_GT(std::stoi(more), 300);
  EXPECT_EQ(said_of_level("medium", "--features " + more), silence);
}

TEST(ProgramChecks, NameMasksOfOtherClasses) {
  EXPECT_NE(said_of_level("medium", "--classes 1,57")
                .find("no instance is of a dynamic class (1, 57); the masks hold class 0"),
            std::string::npos);
}

class RecordedChecks : public RecordedData {
 protected:
  std::string said_of(const char* name, const std::string& more = "") const {
    return said(quoted(data(name)) + ' ' + more);
  }
};

TEST_F(RecordedChecks, AreSilentInStep) {
  EXPECT_EQ(said_of("tum_fr3_walking_halfsphere_50", "--depth-offset 0.033"), silence);
  EXPECT_EQ(said_of("composite_person_in_step_48"), silence);
  EXPECT_EQ(said_of("boxes_25"), silence);
  EXPECT_EQ(said_of("classroom_one_38"), silence);
}

TEST_F(RecordedChecks, AreSilentInLongerOnesSlow) {
  EXPECT_EQ(
      said_of("tum_fr1_xyz_120", "--depth-offset 0.033"),
      "\nchecks of the input\n* unchecked: fewer than 8 frames had masks, so that this was not "
      "checked");  // it has none
  for (const char* name : {"man_on_fr1_120", "crowd_on_fr1_120"}) {
    EXPECT_EQ(said_of(name), silence) << name;
  }
}

TEST_F(RecordedChecks, NameLateDepth) {
  for (const char* name : {"tum_fr3_walking_halfsphere_50", "composite_person_depth_late_48"}) {
    const std::string text = said_of(name);
    EXPECT_NE(text.find("* depth_late: depth is late by "), std::string::npos) << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '*'), 1) << text;
  }
}

TEST_F(RecordedChecks, SeeThatMasksAreErodedByEightPixels) {
  const TemporaryFolder eroded;
  const char* const name = "tum_fr3_walking_halfsphere_50";
  const fs::path masks = eroded.path() / "masks";
  fs::copy(data(name) / "masks", masks);
  change_images(masks, [](const cv::Mat& labels) {
    cv::Mat smaller;
    cv::erode(labels, smaller, cv::getStructuringElement(cv::MORPH_ELLIPSE, {17, 17}));
    return smaller;
  });
  const std::string text = said_of(name, "--depth-offset 0.033 --masks " + quoted(masks));
  EXPECT_NE(text.find("* masks_small: people reach "), std::string::npos) << text;
}

}  // namespace
}  // namespace dynfilter::testing
