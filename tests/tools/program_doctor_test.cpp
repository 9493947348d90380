// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// `dynfilter doctor`.

#include "dynfilter/version.hpp"
#include "support/test.hpp"
#include "tools/changed_scene.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

class Doctor : public CopiedSceneTest<Doctor> {
 public:
  static constexpr const char* synth_options = "--frames 12 --width 320 --height 240";

 protected:
  Outcome examined() const { return run("doctor " + quoted(scene())); }
};

TEST(DoctorAlone, NamesVersionsAndWhatIsBuiltIn) {
  const Outcome outcome = succeed("doctor");
  for (const char* part : {DYNFILTER_VERSION_STRING, "OpenCV ", "dense D-LBP uses: ", "networks: "})
    expect_mentions(outcome, part);
}

TEST_F(Doctor, FindsNothingBrokenInARenderedSceneAndChangesNothing) {
  const auto before = file_tree(scene());
  const Outcome outcome = examined();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_FALSE(outcome.mentions("broken")) << outcome.printed;
  EXPECT_FALSE(outcome.mentions("odd ")) << outcome.printed;
  expect_mentions(outcome, "fine    12 of 12 frames were checked\n");
  EXPECT_EQ(file_tree(scene()), before);
}

TEST_F(Doctor, NamesABrokenImageOnceAndBlamesNothingElse) {
  for (const char* kind : {"depth", "rgb"}) {
    const fs::path first = files_in(scene() / kind).front(), aside = folder_ / "aside.png";
    fs::rename(first, aside);
    std::ofstream(first) << "no image";
    const Outcome outcome = examined();
    EXPECT_NE(outcome.exit_code, 0);
    expect_mentions(outcome, "broken  " + first.string());
    EXPECT_EQ(outcome.printed.find("broken"), outcome.printed.rfind("broken")) << outcome.printed;
    fs::rename(aside, first);
  }
}

TEST_F(Doctor, NamesTheCameraFileIfNoFrameFits) {
  set_camera(scene(), "Camera.width", "Camera.width: 640");
  const Outcome outcome = examined();
  EXPECT_NE(outcome.exit_code, 0);
  expect_mentions(outcome, "so it is with every frame");
  expect_mentions(outcome, "is the camera file another camera's?");
}

TEST_F(Doctor, CountsFramesWithoutMasksForWhichRunStops) {
  const auto masks = files_in(scene() / "masks");
  for (std::size_t i = 0; i < 3; ++i) fs::remove(masks[i]);
  fs::remove(scene() / "masks" / "instances.csv");
  const Outcome outcome = examined();
  EXPECT_NE(outcome.exit_code, 0);
  expect_mentions(outcome, "3 of 12 frames have no mask");
  fs::remove_all(scene() / "masks");
  fs::remove(scene() / "masks_true" / "instances.csv");
  fs::remove(scene() / "masks_true" / masks[4].filename());
  expect_mentions(examined(), "masks_true/" + masks[4].filename().string() + ": there is no such");
}

TEST_F(Doctor, SaysWhatIsMissing) {
  fs::remove_all(scene() / "masks");
  const Outcome without = examined();
  EXPECT_EQ(without.exit_code, 0) << without.printed;
  expect_mentions(without, "no masks/");
  expect_mentions(without, "fewer than 8 frames had masks, so that this was not checked");
  fs::remove(scene() / "camera.yaml");
  const Outcome broken = examined();
  EXPECT_NE(broken.exit_code, 0);
  expect_mentions(broken, "camera.yaml");
  expect_refused("doctor " + quoted(scene() / "nowhere"), "nowhere");
}

TEST_F(Doctor, ReadsThePluginsSettings) {
  const fs::path file = scene() / "TUM3.yaml";
  const std::string masks = "dynfilter.mask_folder: \"" + (scene() / "masks").string() + "\"\n";
  const auto examined = [&](const std::string& lines) {
    std::ofstream(file) << "%YAML:1.0\nDepthMapFactor: 5000.0\n" << lines;
    return run("doctor --settings " + quoted(file));
  };
  const Outcome good = examined(masks);
  EXPECT_EQ(good.exit_code, 0) << good.printed;
  expect_mentions(good, "fine    12 masks in ");
  EXPECT_FALSE(good.mentions("odd ")) << good.printed;
  EXPECT_TRUE(examined("dynfilter.enabled: 0\n").mentions("odd     the filter is switched off"));
  const char* const broken[][2] = {
      {"dynfilter.margin: 2", "there is no setting dynfilter.margin. "},
      {"dynfilter.margin_px: -1", "margin_px = -1"},
      {"dynfilter.rule: \"best\"", "want one of depth, paper, mask"}};
  for (const auto& [line, part] : broken) {
    const Outcome outcome = examined(masks + line + "\n");
    EXPECT_EQ(outcome.exit_code, 1) << outcome.printed;
    EXPECT_TRUE(outcome.mentions("broken  ") && outcome.mentions(part)) << outcome.printed;
    expect_mentions(outcome, "TUM3.yaml cannot be used as it is");
  }
  const Outcome nowhere = examined("dynfilter.mask_folder: \"no_such_folder\"\n");
  EXPECT_TRUE(nowhere.mentions("broken  ") && nowhere.mentions("no_such_folder"))
      << nowhere.printed;
  // Of a fisheye pair.
  const std::string right = "dynfilter_right.mask_folder: \"" + (scene() / "masks").string() + '"';
  const Outcome both = examined(masks + right + '\n');
  EXPECT_EQ(both.exit_code, 0) << both.printed;
  expect_mentions(both, "every key of dynfilter_right is known");
  EXPECT_FALSE(good.mentions("dynfilter_right")) << good.printed;
  const Outcome bad = examined(masks + right + "\ndynfilter_right.margin: 2\n");
  EXPECT_EQ(bad.exit_code, 1) << bad.printed;
  expect_mentions(bad, "there is no setting dynfilter_right.margin. ");
}

}  // namespace
}  // namespace dynfilter::testing
