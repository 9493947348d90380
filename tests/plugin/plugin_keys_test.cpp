// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Keys of the settings file: those that the plugin takes, and the messages of those that it
// refuses.

#include "dynfilter/plugin.hpp"

#include "dynfilter/dynfilter.hpp"
#include "support/host_frame.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

class PluginKeys : public PluginTest {
 protected:
  static void expect_refused(const std::string& file, const std::string& message) {
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, file + ": ");
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, message);
  }

  static FrameStatistics filtered(const std::string& file) {
    Plugin plugin(file);
    HostFrame frame(0);
    return filter_rgbd(plugin, frame);
  }
};

TEST_F(PluginKeys, ArriveInTheFilter) {
  cv::Mat robot = cv::Mat::zeros(image_size, CV_8UC1);
  robot.row(119).setTo(255);
  std::ofstream(path("robot.pgm")) << "P5\n160 120\n255\n"
                                   << std::string(robot.begin<char>(), robot.end<char>());
  const std::string all =
      "dynfilter.enabled: 1\ndynfilter.max_time_difference_s: 0.002\n"
      "dynfilter.missing_masks: \"keep\"\ndynfilter.dynamic_classes: [ 0, 16 ]\n"
      "dynfilter.margin_px: 2\ndynfilter.static_mask: \"" +
      path("robot.pgm").string() +
      "\"\ndynfilter.floor: 100\ndynfilter.motion: 0\n"
      "dynfilter.propagate: \"no\"\ndynfilter.colour_order: \"rgb\"\ndynfilter.output_folder: \"" +
      path("all").string() + "\"\ndynfilter.overlay_every: 2\n";
  DynamicFilterOptions options;
  options.mask_culler.dynamic_classes = {0, 16};
  options.mask_culler.margin_px = 2;
  options.mask_culler.static_mask = robot;
  const std::pair<CompensationRule, std::string> rules[] = {{CompensationRule::depth, "depth"},
                                                            {CompensationRule::paper, "paper"},
                                                            {CompensationRule::mask, "mask"}};
  for (const auto& [rule, name] : rules) {
    SCOPED_TRACE(name);
    options.compensator.rule = rule;
    const HostFrame frame(0);
    const FrameStatistics want = DynamicFilter(options)
                                     .apply(frame.view(0), frame.segmentation, frame.keypoints)
                                     .statistics();
    const FrameStatistics got = filtered(settings(all + "dynfilter.rule: \"" + name + "\"\n"));
    EXPECT_EQ(got.masked, want.masked);
    EXPECT_EQ(got.compensated, want.compensated);
    EXPECT_EQ(got.instances.at(0).sampled, want.instances.at(0).sampled);
  }
}

TEST_F(PluginKeys, SetTheHalfWidthOfTheObjectsRange) {
  const auto range_m = [&](const std::string& lines) {
    const ValueRange range = filtered(settings(lines)).instances.at(0).depth_range_m;
    return range.upper - range.lower;
  };
  EXPECT_EQ(range_m("dynfilter.half_width_m: 0.55\n"), range_m(""));
  EXPECT_NEAR(range_m("dynfilter.half_width_m: 0.3\n"), range_m("") - 0.5, 1e-6);
}

TEST_F(PluginKeys, RefuseWrongValues) {
  const std::pair<std::string, std::string> wrong[] = {
      {"margin: 3",
       "there is no setting dynfilter.margin. The settings are: dynfilter.enabled, "
       "dynfilter.mask_folder, "},
      {"Rule: \"paper\"", "dynfilter.rule, "},
      {"enabled: 2", "dynfilter.enabled: got 2; want 0 or 1, or \"no\" or \"yes\""},
      {"propagate: \"maybe\"", "dynfilter.propagate: got \"maybe\"; want 0 or 1"},
      {"async: \"late\"", "dynfilter.async: got \"late\"; want one of wait"},
      {"floor: 99999999999", "dynfilter.floor: got inf; want a whole number of at least 0"},
      {"dynamic_classes: [ 0, 4294967296 ]", "dynfilter.dynamic_classes: got inf in it"},
      {"margin_px: \"wide\"", "dynfilter.margin_px: got \"wide\"; want a finite number"},
      {"margin_px: .nan", "nan; want a finite number"},
      {"margin_px: -1", "margin_px = -1"},
      {"half_width_m: -1", "half_width_m = -1"},
      {"max_time_difference_s: -1.0", "dynfilter.max_time_difference_s: got -1; want at least 0"},
      {"min_depth_m: 0", "dynfilter.min_depth_m: got 0; want above 0"},
      {"colour_order: \"gbr\"", "dynfilter.colour_order: got \"gbr\"; want one of bgr, rgb"},
      {"missing_masks: \"skip\"", "want one of error, keep"},
      {"rule: \"best\"", "dynfilter.rule: got \"best\"; want one of depth, paper, mask"},
      {"dynamic_classes: 0", "dynfilter.dynamic_classes: got 0; want a list of whole numbers"},
      {"dynamic_classes: [ 0, \"person\" ]", "dynfilter.dynamic_classes: got \"person\" in it"},
      {"static_mask: \"nowhere.png\"", "nowhere.png"},
      {"floor: -1", "dynfilter.floor: got -1; want a whole number of at least 0"},
      {"floor: 3\ndynfilter.floor: 5", "dynfilter.floor: got the key twice; want it once"},
      {"output_folder: 5", "dynfilter.output_folder: got 5; want a text in quotes"},
      {"overlay_every: \"often\"", "dynfilter.overlay_every: got \"often\""},
  };
  for (const auto& [line, message] : wrong) {
    SCOPED_TRACE(line);
    expect_refused(settings("dynfilter." + line + "\n"), message);
  }
  for (const char* block : {"dynfilter:\n  floor: 300\n", "dynfilter: { floor: 300 }\n"}) {
    expect_refused(settings(block),
                   "dynfilter: got settings in a block; want each in a line of its own, as "
                   "dynfilter.mask_folder: \"masks\"");
  }
  EXPECT_NO_THROW(Plugin{settings("dynfilter.max_time_difference_s: 0\n")});
  const TemporaryFolder folder;
  for (const char* value : {"\"5000\"", "[ 5000 ]", "-5000.0", ".inf"}) {
    const std::string lines = "%YAML:1.0\nDepthMapFactor: " + std::string(value) +
                              "\ndynfilter.mask_folder: \"" + masks().string() + "\"\n";
    expect_refused(folder.write("TUM3.yaml", lines).string(), "DepthMapFactor: got ");
  }
  for (const char* value : {"1e300", "-1", "4294967297"}) {
    const std::string lines = "%YAML:1.0\nORBextractor.nFeatures: " + std::string(value) +
                              "\ndynfilter.mask_folder: \"" + masks().string() + "\"\n";
    expect_refused(folder.write("TUM3.yaml", lines).string(), "ORBextractor.nFeatures: got ");
  }
}

TEST_F(PluginKeys, AreRefusedWhereTheyWouldBeIgnored) {
  const std::pair<std::string, std::string> useless[] = {
      {"overlay_every: 30", "overlay_every: got 30, but no output_folder; want both, or neither"},
      {"async: \"latest\"", "async: got \"latest\", but no remote or model"},
      {"rule: \"paper\"\ndynfilter.half_width_m: 1", "got 1, but no rule: \"depth\""},
      {"rule: \"mask\"\ndynfilter.min_depth_m: 1", "min_depth_m: got 1, but no rule: "},
      {"device: \"cuda\"", "dynfilter.device: got \"cuda\", but no model"},
  };
  for (const auto& [line, message] : useless) {
    expect_refused(settings("dynfilter." + line + "\n"), message);
  }
  expect_refused(raw_settings("dynfilter.remote: \"x\"\ndynfilter.max_time_difference_s: 1\n"),
                 "max_time_difference_s: got 1, but no mask_folder");
  EXPECT_NO_THROW(Plugin{settings("dynfilter.overlay_every: 0\n")});
}

TEST_F(PluginKeys, TakeBothFormsOfYesAndNo) {
  for (const char* no : {"0", "\"no\"", "no"}) {
    EXPECT_FALSE(Plugin(settings("dynfilter.enabled: " + std::string(no) + "\n")).enabled());
  }
  const std::string camera = "Camera.fy: 535.4\nCamera.cx: 80\nCamera.cy: 60\n";
  for (const char* yes : {"1", "\"yes\"", "yes"}) {
    const std::string value = ": " + std::string(yes) + "\n";
    Plugin plugin(settings(camera + "dynfilter.enabled" + value + "dynfilter.propagate" + value +
                           "dynfilter.rule: \"mask\"\ndynfilter.motion" + value));
    HostFrame frame(0);
    EXPECT_EQ(submit_and_filter(plugin, frame).motion.outcome, MotionOutcome::started);
  }
}

TEST_F(PluginKeys, AreListedIfThereIsNone) {
  for (const char* part : {"dynfilter.mask_folder: \"masks\"", "dynfilter.enabled: 0",
                           "dynfilter.margin_px, ", "dynfilter.overlay_every"}) {
    expect_refused(raw_settings(""), part);
  }
  expect_refused(raw_settings("dynfilter.margin_px: 1\n"), "dynfilter.mask_folder: got nothing");
}

TEST_F(PluginKeys, OfTheHostAreIgnored) {
  const std::string file = settings(
      "Camera.width: 00640\nViewer.x: 0x10\nViewer.x: 3\n"
      "Camera.type: \"PinHole\"   # with a comment: dynfilter.floor: \"x\"\n"
      "Tbc: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: f\n   data: [ 1.0, 2.0 ]\n"
      "Block:\n   dynfilter.floor: \"x\"\n   DepthMapFactor: \"none\"\n"
      "dynfiltered: 010\nText: 'dynfilter.floor: x'\n"
      "dynfilter.floor: 300 # features\ndynfilter.dynamic_classes:\n  - 0\n  - 16 # a dog\n");
  EXPECT_GT(filtered(file).masked, 0U);
}

TEST_F(PluginKeys, StandInARegularYamlFile) {
  for (const char* name : {"what?.yaml", "%20.yml", "empty ?"}) {
    SCOPED_TRACE(name);
    settings();
    const std::string named = path(name).string();
    std::filesystem::rename(file(), named);
    EXPECT_GT(filtered(named).masked, 0U);
  }
  expect_refused(path("none.yaml").string(), "there is no such file");
  expect_refused(masks().string(), "is not a regular file");
  std::ofstream(path("bad.yaml")) << "this is: [ no yaml\n of: opencv";
  expect_refused(path("bad.yaml").string(), "is no OpenCV YAML file");
}

}  // namespace
}  // namespace dynfilter::testing
