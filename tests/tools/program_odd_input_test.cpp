// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Sequences and options that a sub-command must not take in silence.

#include "support/neighbours.hpp"
#include "support/test.hpp"
#include "tools/changed_scene.hpp"
#include "tools/program.hpp"

namespace dynfilter::testing {
namespace {

class OddInput : public ::testing::Test {
 protected:
  fs::path scene(int frames) {
    succeed("synth " + quoted(folder_ / "scene") + " --width 64 --height 48" + " --frames " +
            std::to_string(frames));
    return folder_ / "scene";
  }

  /// Resizes the colour and the depth image of this name.
  static void resize(const fs::path& sequence, const std::string& name, cv::Size size) {
    for (const char* kind : {"rgb", "depth"}) {
      const std::string file = (sequence / kind / name).string();
      cv::Mat image = read_unchanged(file);
      ASSERT_FALSE(image.empty()) << file;
      cv::resize(image, image, size, 0, 0, cv::INTER_NEAREST);
      cv::imwrite(file, image);
    }
  }

  TemporaryFolder folder_;
};

TEST_F(OddInput, OptionsWithoutEffectAndEmptyValuesAreRefused) {
  const std::string of = " " + quoted(scene(2));
  const std::string out = " --out " + quoted(folder_ / "out");
  expect_refused("run" + of + " --frames 1", "--frames requires --level");
  expect_refused("ablate" + of + " --seeds 1-2", "--seeds requires --levels");
  expect_refused("ablate --levels medium --degrade poor" + out, "--degrade requires SEQUENCES");
  expect_refused("ablate --levels medium --depth-offset 0.03" + out,
                 "--depth-offset requires SEQUENCES");
  expect_refused("run --level medium --depth-offset 0.03" + out,
                 "--depth-offset requires SEQUENCE");
  for (const char* rule : {"motion", "perfect"}) {
    expect_refused(
        "run" + of + " --masks " + quoted(folder_ / "scene/masks") + " --rule " + rule + out,
        "takes no masks");
  }
  expect_refused("doctor --camera camera.yaml", "--camera requires SEQUENCE");
  expect_refused("run" + of + " --masks ''", "--masks: got an empty");
  expect_refused("doctor ''", "SEQUENCE: got an empty");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(OddInput, StaleMasksOfALevelHaveTheirTime) {
  const fs::path stale = folder_ / "stale";
  succeed("synth " + quoted(stale) + " --level stale_3 --frames 5 --width 160 --height 120");
  const std::string rows = read_by_others("csv " + quoted(stale / "masks/instances.csv"));
  EXPECT_NE(rows.find("\n1.133333|1|"), std::string::npos) << "the last frame";
  EXPECT_EQ(rows.substr(rows.size() - 10), "|1.033333\n") << rows;
  expect_mentions(run("synth " + quoted(folder_ / "x") + " --level easy"), "medium");
}

TEST_F(OddInput, FoldersOfPhotosMayHoldLoopsButNoControlCharacters) {
  const fs::path rgb = scene(2) / "rgb", photos = folder_ / "photos";
  fs::create_directories(photos);
  fs::rename(rgb, photos / "2026");
  for (const char* link : {"photos/latest", "photos/2026/latest"}) {
    fs::create_directory_symlink(photos, folder_ / link);
  }
  const std::string command = "run " + quoted(photos) + " --out " + quoted(folder_ / "out");
  expect_mentions(succeed(command), "no depth images, so masks act alone");
  EXPECT_EQ(read_json(folder_ / "out/summary.json")["frames"], 2);
  fs::rename(photos / "2026/1.000000.png", photos / "2026/a\nb.png");
  expect_refused(command, "2026/a?b.png has a control character in its name\n");
}

TEST_F(OddInput, ImagesOfDifferentSizesAreRefusedByName) {
  const fs::path sequence = scene(3);
  for (const char* key : {"Camera.width", "Camera.height"}) set_camera(sequence, key, "");
  for (const char* masks : {"masks", "masks_true"}) fs::remove_all(sequence / masks);
  resize(sequence, "1.066667.png", {80, 60});
  expect_refused("run " + quoted(sequence) + " --rule none --out " + quoted(folder_ / "out"),
                 "1.066667.png: 80x60 pixels, but earlier images have 64x48");
}

struct NumberOption {
  const char* command;
  const char* option;
  std::vector<const char*> refused;
};

// 4294967297 is 2^32 + 1: as an int, 1.
const NumberOption number_options[] = {
    {"synth OUT", "--frames", {"0", "-1", "4294967297", "1.5", "x"}},
    {"synth OUT", "--width", {"15", "8193", ""}},
    {"synth OUT", "--seed", {"-1", "x", "99999999999999999999"}},
    {"run --level medium", "--features", {"0", "100001", "010", "0x10"}},
    {"run --level medium", "--every", {"0", "1000001"}},
    {"run --level medium", "--scene-seed", {"-1", "99999999999999999999"}},
    {"run --level medium", "--classes", {"-1", "0,4294967296", "a"}},
    {"run --level medium", "--margin", {"-1", "inf", "1e7"}},
    {"ablate --levels medium", "--frames", {"0", "4294967297"}},
    {"run x", "--depth-offset", {"11"}},
    {"sync x", "--depth-offset", {"11"}},
    {"ablate x", "--depth-offset", {"11"}},
    {"eval a.txt b.txt", "--max-difference", {"-1", "inf", "11"}},
};

TEST_F(OddInput, NumbersOutOfRangeAreRefusedByName) {
  const fs::path out = folder_ / "out";
  for (const NumberOption& option : number_options) {
    for (const char* value : option.refused) {
      std::string command = option.command;
      const std::size_t place = command.find("OUT");
      if (place != std::string::npos) command.replace(place, 3, quoted(out));
      if (command.compare(0, 4, "run ") == 0) command += " --out " + quoted(out);
      const Outcome outcome = run(command + " " + option.option + " '" + value + "'");
      SCOPED_TRACE(command + " " + option.option + " " + value + "\n" + outcome.printed);
      EXPECT_NE(outcome.exit_code, 0);
      EXPECT_TRUE(outcome.mentions(option.option));
      EXPECT_FALSE(fs::exists(out)) << "no output may be written";
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
