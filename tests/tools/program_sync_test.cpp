// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// dynfilter sync, and the other commands with depth that is out of step.

#include <nlohmann/json.hpp>

#include "support/neighbours.hpp"
#include "support/test.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

/// Recording of 30 frames. Its lists of depth images name each image a frame later than it was
/// made, so that depth is late by a frame.
class ProgramSync : public CopiedSceneTest<ProgramSync> {
 public:
  static constexpr const char* synth_options = "--frames 30 --width 320 --height 240 --seed 11";

 protected:
  static void SetUpTestSuite() {
    CopiedSceneTest::SetUpTestSuite();
    fs::remove(made() / "associations.txt");
    std::ifstream in(made() / "depth.txt");
    std::string late, line, time, file, last;
    while (std::getline(in, line)) {
      if (line[0] == '#') continue;
      std::istringstream(line) >> time >> file;
      if (!last.empty()) late += time + " " + last + "\n";
      last = file;
    }
    in.close();
    std::ofstream(made() / "depth.txt") << late;
  }
};

TEST_F(ProgramSync, MeasuresAndWritesAssociationsThatAreInStep) {
  const fs::path pairs = scene() / "associations.txt";
  const Outcome examined = run("doctor " + quoted(scene()));
  const Outcome outcome = succeed("sync " + quoted(scene()) + " --write " + quoted(pairs));
  expect_mentions(outcome, "depth is late by ");
  expect_mentions(outcome, "recommended: --depth-offset 0.03");
  expect_mentions(examined, "pair the images anew: --depth-offset 0.03");
  for (const Outcome& advice : {outcome, examined}) {
    EXPECT_TRUE(advice.mentions("for a SLAM program `dynfilter sync SEQUENCE --write FILE`"));
    EXPECT_FALSE(advice.mentions("dynfilter.depth_offset_s")) << "the plugin refuses it";
  }
  // The k-th image goes with the depth image that was made with it.
  const auto frames = load_images(pairs);
  EXPECT_EQ(frames.size(), 29U);
  for (const OrbSlamFrame& frame : frames) {
    EXPECT_EQ(frame.image.substr(0, 4), "rgb/");
    EXPECT_EQ(fs::path(frame.image).stem(), fs::path(frame.depth).stem());
    EXPECT_GT(frame.depth_time_s, frame.time_s);
  }
  const Outcome again = run("sync " + quoted(scene()));
  expect_mentions(again, "recommended: keep the pairs");
}

TEST_F(ProgramSync, WritesNewFilesOnly) {
  const fs::path mine = folder_ / "mine.txt";
  std::ofstream(mine) << "mine\n";
  fs::create_symlink(folder_ / "nothing", scene() / "dangling");
  for (const fs::path& file : {mine, scene() / "depth.txt", folder_.path(), scene() / "dangling"}) {
    expect_refused("sync " + quoted(scene()) + " --write " + quoted(file),
                   file.string() + ": exists; name another file");
  }
  EXPECT_EQ(file_text(mine), "mine\n");
  EXPECT_FALSE(fs::exists(folder_ / "nothing"));
}

TEST_F(ProgramSync, ListsFilesThatAnAbsoluteListNames) {
  const fs::path other = folder_ / "other", pairs = folder_ / "pairs.txt";
  fs::create_directories(other);
  fs::copy(scene() / "camera.yaml", other);
  for (const std::string list : {"rgb.txt", "depth.txt"}) {
    std::ifstream old(scene() / list);
    std::ofstream rows(other / list);
    for (std::string row; std::getline(old, row);) {
      const std::size_t space = row.find(' ');
      if (row[0] == '#') continue;
      rows << row.substr(0, space + 1) << fs::absolute(scene() / row.substr(space + 1)).string()
           << '\n';
    }
  }
  succeed("sync " + quoted(other) + " --write " + quoted(pairs));
  const auto frames = load_images(pairs);
  EXPECT_EQ(frames.size(), 29U);
  for (const OrbSlamFrame& frame : frames) {
    for (const std::string& file : {frame.image, frame.depth}) {
      EXPECT_TRUE(fs::is_regular_file(other.string() + '/' + file)) << file;
    }
  }
  fs::rename(scene() / "rgb", scene() / "r gb");
  fs::create_directory_symlink("r gb", scene() / "rgb");
  fs::remove(pairs);
  expect_refused("sync " + quoted(other) + " --write " + quoted(pairs), "has a blank in its path");
}

TEST_F(ProgramSync, RunSaysItUntilTheOffsetIsGiven) {
  const fs::path out = folder_ / "out";
  const std::string command =
      "run " + quoted(scene()) + " --rule mask --features 200 --overlays 0 --out " + quoted(out);
  const Outcome late = succeed(command);
  expect_mentions(late, "* depth_late: depth is late by ");
  nlohmann::json summary;
  std::ifstream(out / "summary.json") >> summary;
  EXPECT_TRUE(summary["checks"].contains("depth_late"));
  EXPECT_EQ(summary["frames"], 29);
  EXPECT_EQ(summary["depth_offset_s"], 0);
  EXPECT_FALSE(late.mentions("paired with an offset")) << late.printed;

  const Outcome in_step = succeed(command + " --depth-offset 0.0333");
  EXPECT_FALSE(in_step.mentions("depth is late by ")) << in_step.printed;
  std::ifstream(out / "summary.json") >> summary;
  EXPECT_FALSE(summary["checks"].contains("depth_late"));
  EXPECT_EQ(summary["depth_offset_s"], 0.0333);
  expect_mentions(in_step, ", depth paired with an offset of 0.033 s\n");
}

}  // namespace
}  // namespace dynfilter::testing
