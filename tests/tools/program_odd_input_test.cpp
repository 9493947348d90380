// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Sequences and options that a sub-command must not take in silence.

#include <fstream>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "support/changed_scene.hpp"
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
    for (const char* key : {"Camera.width", "Camera.height"}) set_camera(sequence, key, "");
    fs::remove_all(sequence / "masks");
    fs::remove_all(sequence / "masks_true");
    return sequence;
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

  void expect_refused(const std::string& arguments, const std::string& part) const {
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.exit_code, 0) << arguments << '\n' << outcome.printed;
    EXPECT_TRUE(outcome.mentions(part)) << arguments << '\n' << outcome.printed;
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
  expect_refused("doctor --camera camera.yaml", "--camera requires SEQUENCE");
  expect_refused("run" + of + " --masks ''", "--masks: got an empty");
  expect_refused("doctor ''", "SEQUENCE: got an empty");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(OddInput, ImagesOfDifferentSizesAreRefusedByName) {
  const fs::path sequence = scene_of_any_size(3);
  resize(sequence, "1.066667.png", {80, 60});
  expect_refused("run " + quoted(sequence) + " --rule none --out " + quoted(folder_ / "out"),
                 "1.066667.png: 80x60 pixels, but earlier images have 64x48");
}

}  // namespace
}  // namespace dynfilter::testing
