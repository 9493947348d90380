// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// `--truth motion`: scores and the rule perfect by what moves in a frame.

#include "lab/odometry/orb_extractor.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

constexpr int frames = 4;
const cv::Size image_size{320, 240};
constexpr const char* size_options = " --frames 4 --width 320 --height 240";

constexpr const char* score_names[] = {"dynamic_left", "dynamic_removed", "static_left",
                                       "static_removed"};

/// Runs one rule and returns its summary.
nlohmann::json summary_of(const std::string& arguments) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "out";
  const Outcome outcome =
      succeed("run " + arguments + " --features 400 --overlays 0 --out " + quoted(out));
  return outcome.exit_code == 0 ? read_json(out / "summary.json") : nlohmann::json::object();
}

std::string level(const std::string& name) {
  return "--level " + name + " --scene-seed 11" + size_options;
}

/// Counts what the rule mask leaves and removes on and off what moves, feature by feature.
nlohmann::json recount(const std::string& level_name) {
  SyntheticSceneOptions options = scene_level(level_name, 11);
  options.frames = frames;
  options.image_size = image_size;
  const SyntheticScene scene(options);
  const odometry::OrbExtractor extractor(400);
  nlohmann::json counts;
  for (const char* name : score_names) counts[name] = 0;
  counts["rim_left"] = counts["rim_removed"] = 0;
  for (int i = 0; i < frames; ++i) {
    const SyntheticFrame rendered = scene.render(i);
    const cv::Mat1b masks = painted(rendered.poor_segmentation);
    cv::Mat grey, descriptors;
    cv::Mat1f to_moving;
    cv::distanceTransform(rendered.moving_mask == 0, to_moving, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    std::vector<cv::KeyPoint> keypoints;
    cv::cvtColor(rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
    extractor.extract(grey, keypoints, descriptors);
    for (const cv::KeyPoint& keypoint : keypoints) {
      const cv::Point pixel(static_cast<int>(std::floor(keypoint.pt.x + 0.5F)),
                            static_cast<int>(std::floor(keypoint.pt.y + 0.5F)));
      const bool removed = masks(pixel) != 0;
      const float distance = to_moving(pixel);
      const std::string kind = distance == 0 ? "dynamic" : distance <= 3 ? "rim" : "static";
      const std::string name = kind + (removed ? "_removed" : "_left");
      counts[name] = counts[name].get<int>() + 1;
    }
  }
  return counts;
}

TEST(Truth, ScoresByMotionEqualANaiveRecount) {
  for (const char* name : {"sitting", "carried", "pushed"}) {
    const nlohmann::json expected = recount(name);
    const nlohmann::json summary = summary_of(level(name) + " --rule mask --truth motion");
    for (const char* score : score_names)
      EXPECT_EQ(summary[score], expected[score]) << name << ' ' << score;
    EXPECT_GT(expected["dynamic_left"], 10) << name;
  }
}

TEST(Truth, StillPersonIsStaticByMotionOnly) {
  const nlohmann::json by_class = summary_of(level("sitting") + " --rule mask");
  const nlohmann::json by_motion = summary_of(level("sitting") + " --rule mask --truth motion");
  EXPECT_EQ(by_class["masked"], by_motion["masked"]) << "the rule itself knows no truth";
  EXPECT_EQ(by_class["options"]["truth"], "class");
  EXPECT_EQ(by_motion["options"]["truth"], "motion");
  // The masks lie on persons. The sitting one's features are most of those removed.
  EXPECT_LT(by_class["static_removed"], frames);
  EXPECT_GT(by_motion["static_removed"], 20 * frames);
}

TEST(Truth, PerfectRuleRemovesJustWhatMoves) {
  const std::string perfect = level("sitting") + " --rule perfect";
  const nlohmann::json by_class = summary_of(perfect);
  const nlohmann::json by_motion = summary_of(perfect + " --truth motion");
  for (const nlohmann::json& summary : {by_class, by_motion}) {
    EXPECT_EQ(summary["dynamic_left"], 0);
    EXPECT_GT(summary["dynamic_removed"], 0);
    EXPECT_EQ(summary["static_removed"], 0);
  }
  EXPECT_GT(by_motion["kept"].get<int>(), by_class["kept"].get<int>() + 20 * frames);
  const nlohmann::json of_chairs = summary_of(perfect + " --truth motion --classes 56");
  EXPECT_EQ(of_chairs["kept"], by_motion["kept"]) << "what moves is dynamic, whatever its class";
  const nlohmann::json box = summary_of(level("pushed") + " --rule perfect --truth motion");
  EXPECT_GT(box["dynamic_removed"], 0) << "a box is no person";
  EXPECT_EQ(box["dynamic_left"], 0);
}

/// Sequence in a folder, with the masks of what moves.
class TruthOfAFolder : public CopiedSceneTest<TruthOfAFolder> {
 public:
  static constexpr const char* synth_options =
      "--level carried --seed 11 --frames 4 --width 320 --height 240";

 protected:
  fs::path out() const { return folder_ / "out"; }
};

TEST_F(TruthOfAFolder, GivesTheScoresOfItsLevel) {
  for (const char* rule : {"mask", "perfect"}) {
    const std::string options = std::string(" --truth motion --rule ") + rule;
    const nlohmann::json read = summary_of(quoted(scene()) + options);
    const nlohmann::json rendered = summary_of(level("carried") + options);
    for (const char* score : score_names) EXPECT_EQ(read[score], rendered[score]) << score;
    EXPECT_EQ(read["kept"], rendered["kept"]) << rule;
  }
}

TEST_F(TruthOfAFolder, NamesMissingMasks) {
  const auto expect_missing = [&](const std::string& what) {
    for (const std::string& command : {"run " + quoted(scene()), "ablate " + quoted(scene())}) {
      expect_refused(command + " --truth motion --out " + quoted(out()), what);
      EXPECT_FALSE(fs::exists(out())) << "nothing starts";
    }
  };
  fs::remove(scene() / "masks_moving/1.033333.png");
  expect_missing("masks_moving/1.033333.png: there is no such mask; frame 1.033333 needs it");
  EXPECT_EQ(summary_of(quoted(scene()) + " --rule mask")["options"]["truth"], "class")
      << "the other truth does without";
  fs::remove_all(scene() / "masks_moving");
  expect_missing("masks_moving: there is no such folder; truth by motion needs");
}

TEST_F(TruthOfAFolder, NeedsNoMasksOfPersonsAndResultsSayWhichItIs) {
  fs::remove_all(scene() / "masks_true");
  const Outcome outcome =
      succeed("ablate " + quoted(scene()) +
              " --features 400 --truth motion --rules mask,perfect --out " + quoted(out()));
  expect_mentions(outcome, "\nperfect ");
  expect_mentions(outcome, ", medians over scenes, truth by motion\n");
  expect_mentions(
      run("run " + quoted(scene()) + " --truth motion --overlays 0 --out " + quoted(out() / "one")),
      "against what moves");
}

}  // namespace
}  // namespace dynfilter::testing
