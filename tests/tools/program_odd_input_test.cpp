// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Sequences and options that a sub-command must not take in silence.

#include <fstream>
#include <regex>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

class OddInput : public ::testing::Test {
 protected:
  fs::path scene(int frames) {
    const Outcome synth = run("synth " + quoted(folder_ / "scene") + " --width 64 --height 48" +
                              " --frames " + std::to_string(frames));
    EXPECT_EQ(synth.exit_code, 0) << synth.printed;
    return folder_ / "scene";
  }

  /// Scene without masks, whose camera file tells no size.
  fs::path scene_of_any_size(int frames) {
    const fs::path sequence = scene(frames);
    std::ifstream camera(sequence / "camera.yaml");
    std::string without_size;
    for (std::string line; std::getline(camera, line);) {
      if (line.rfind("Camera.width", 0) != 0 && line.rfind("Camera.height", 0) != 0) {
        without_size += line + '\n';
      }
    }
    std::ofstream(sequence / "camera.yaml") << without_size;
    fs::remove_all(sequence / "masks");
    fs::remove_all(sequence / "masks_true");
    return sequence;
  }

  /// Resizes the colour and the depth image of this name.
  static void resize(const fs::path& sequence, const std::string& name, cv::Size size) {
    for (const char* kind : {"rgb", "depth"}) {
      const std::string file = (sequence / kind / name).string();
      cv::Mat image = cv::imread(file, cv::IMREAD_UNCHANGED);
      ASSERT_FALSE(image.empty()) << file;
      cv::resize(image, image, size, 0, 0, cv::INTER_NEAREST);
      cv::imwrite(file, image);
    }
  }

  void expect_refused(const std::string& arguments, const std::string& part) const {
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.exit_code, 0) << arguments << '\n' << outcome.printed;
    EXPECT_TRUE(outcome.mentions(part)) << arguments << '\n' << outcome.printed;
  }

  TemporaryFolder folder_;
};

TEST_F(OddInput, OptionsWithoutEffectAreRefused) {
  const std::string of = " " + quoted(scene(2));
  expect_refused("run" + of + " --frames 1", "--frames requires --level");
  expect_refused("ablate" + of + " --frames 1", "--frames requires --levels");
  expect_refused("ablate" + of + " --seeds 1-2", "--seeds requires --levels");
  const std::string out = " --out " + quoted(folder_ / "out");
  expect_refused("ablate --levels medium --degrade poor" + out, "--degrade requires SEQUENCES");
  expect_refused("ablate --levels medium --depth-offset 0.03" + out,
                 "--depth-offset requires SEQUENCES");
  expect_refused("doctor --camera camera.yaml", "--camera requires SEQUENCE");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(OddInput, EmptyValuesAreRefused) {
  const std::string of = " " + quoted(scene(2));
  for (const std::string option : {"--masks", "--camera", "--model", "--remote", "--out"}) {
    expect_refused("run" + of + " " + option + " ''", option + ": got an empty");
  }
  expect_refused("eval a b --json ''", "--json: got an empty");
  expect_refused("doctor ''", "SEQUENCE: got an empty");
}

TEST_F(OddInput, ImagesOfDifferentSizesAreRefusedByName) {
  const fs::path sequence = scene_of_any_size(3);
  resize(sequence, "1.066667.png", {80, 60});
  expect_refused("run " + quoted(sequence) + " --rule none --out " + quoted(folder_ / "out"),
                 "1.066667.png: 80x60 pixels, but earlier images have 64x48");
}

TEST_F(OddInput, ImagesTooSmallForFeaturesAreRefusedByName) {
  const fs::path sequence = scene_of_any_size(1);
  const std::string call =
      "run " + quoted(sequence) + " --rule none --overlays 0 --out " + quoted(folder_ / "out");
  for (const cv::Size size : {cv::Size(48, 2), cv::Size(2, 2)}) {
    resize(sequence, "1.000000.png", size);
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.exit_code, 0) << size << outcome.printed;
  }
  for (const cv::Size size : {cv::Size(48, 1), cv::Size(1, 48), cv::Size(1, 1)}) {
    resize(sequence, "1.000000.png", size);
    const std::string found = std::to_string(size.width) + "x" + std::to_string(size.height);
    expect_refused(call, "rgb/1.000000.png: " + found +
                             " pixels, too few to look for ORB features; want at least 2x2");
  }
}

TEST_F(OddInput, NamesThatATableCannotHoldAreRefused) {
  const fs::path sequence = scene(2);
  fs::rename(sequence / "rgb/1.000000.png", sequence / "rgb/a,b.png");
  std::ofstream(sequence / "associations.txt") << "1 rgb/a,b.png 1 depth/1.000000.png\n";
  expect_refused("run " + quoted(sequence) + " --rule none --out " + quoted(folder_ / "out"),
                 "a,b.png: has a comma or a quote in its name");
}

TEST_F(OddInput, ImagesOfOneNameAreRefused) {
  const fs::path sequence = scene(2);
  fs::create_directory(sequence / "other");
  fs::rename(sequence / "rgb/1.033333.png", sequence / "other/1.000000.png");
  std::ofstream(sequence / "associations.txt")
      << "1 rgb/1.000000.png 1 depth/1.000000.png\n"
      << "1.033333 other/1.000000.png 1.033333 depth/1.033333.png\n";
  expect_refused("run " + quoted(sequence) + " --rule none --out " + quoted(folder_ / "out"),
                 "rgb/1.000000.png, and results are named by their image");
}

TEST_F(OddInput, ContactSheetShowsSomeOfManyOverlays) {
  const std::string out = quoted(folder_ / "out");
  const Outcome outcome =
      run("run " + quoted(scene(60)) + " --rule none --features 50 --overlays 60 --out " + out);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  int overlays = 0, height = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "out/overlays")) {
    height = cv::imread(entry.path().string()).rows;
    ++overlays;
  }
  EXPECT_EQ(overlays, 60);
  const cv::Mat sheet = cv::imread((folder_ / "out/contact_sheet.png").string());
  EXPECT_EQ(sheet.rows, 50 * (height / 2));
}

}  // namespace
}  // namespace dynfilter::testing
