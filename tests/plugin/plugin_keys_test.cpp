// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Keys of the settings file.

#include "dynfilter/plugin.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "dynfilter/dynfilter.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

TEST_F(PluginTest, AcceptsEveryKey) {
  cv::Mat robot = cv::Mat::zeros(image_size, CV_8UC1);
  robot.row(119).setTo(255);
  std::ofstream(path("robot.pgm")) << "P5\n160 120\n255\n"
                                   << std::string(robot.begin<char>(), robot.end<char>());
  const std::string file = settings(
      "dynfilter.max_time_difference_s: 0.002\ndynfilter.box_margin_px: 10\n"
      "dynfilter.min_pixels: 3\ndynfilter.missing_masks: \"keep\"\ndynfilter.rule: \"paper\"\n"
      "dynfilter.dynamic_classes: [ 0, 16 ]\ndynfilter.margin_px: 2\n"
      "dynfilter.margin_per_diameter: 0.25\ndynfilter.static_mask: \"" +
      path("robot.pgm").string() +
      "\"\ndynfilter.samples: 30\ndynfilter.seed: 3\n"
      "dynfilter.depth.outlier_rule: \"interquartile_range\"\n"
      "dynfilter.depth.outlier_factor: 1.5\ndynfilter.depth.min_samples: 4\n"
      "dynfilter.depth.expansion: 0.2\ndynfilter.code.outlier_rule: \"median_absolute_deviation\"\n"
      "dynfilter.code.outlier_factor: 3\ndynfilter.code.min_samples: 5\n"
      "dynfilter.code.expansion: 20\ndynfilter.depth_lbp.missing_neighbour: \"farther\"\n"
      "dynfilter.missing_depth: \"remove\"\ndynfilter.floor: 100\n"
      "dynfilter.policy: \"restore_best_scored\"\ndynfilter.output_folder: \"" +
      path("all").string() + "\"\ndynfilter.overlay_every: 2\n");
  DynamicFilterOptions options;
  options.mask_culler.dynamic_classes = {0, 16};
  options.mask_culler.margin_px = 2;
  options.mask_culler.margin_per_diameter = 0.25;
  options.mask_culler.static_mask = robot;
  options.compensator.rule = CompensationRule::paper;
  options.compensator.paper.samples = 30;
  options.compensator.paper.seed = 3;
  options.compensator.paper.depth = {OutlierRule::interquartile_range, 1.5, 4, 0.2};
  options.compensator.paper.code = {OutlierRule::median_absolute_deviation, 3, 5, 20};
  options.compensator.paper.depth_lbp.missing_neighbour = MissingNeighbour::farther;
  options.compensator.paper.missing_depth = MissingDepth::remove;
  HostFrame frame(0);
  const FeatureLabels labels =
      DynamicFilter(options).apply(frame.view(0), frame.segmentation, frame.keypoints);
  Plugin plugin(file);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
  EXPECT_EQ(statistics.masked, labels.statistics().masked);
  EXPECT_EQ(statistics.compensated, labels.statistics().compensated);
  EXPECT_EQ(statistics.instances.at(0).sampled, labels.statistics().instances.at(0).sampled);
}

TEST_F(PluginTest, AcceptsTheKeysOfTheDepthRule) {
  const std::string file = settings(
      "dynfilter.rule: \"depth\"\ndynfilter.object_depth.min_half_width_m: 0.2\n"
      "dynfilter.object_depth.max_half_width_m: 0.3\ndynfilter.min_nearness: 2\n"
      "dynfilter.mask_margin_px: 4\ndynfilter.stale_age_s: 0.5\ndynfilter.motion_px_per_s: 100\n"
      "dynfilter.shadow_px: 3\ndynfilter.min_nearness_in_shadow: 3\n"
      "dynfilter.max_beyond_range_m: 0.1\ndynfilter.min_off_middle_m: 0.05\n");
  DynamicFilterOptions options;
  options.compensator.depth.shadow_px = 3;
  options.compensator.depth.min_nearness_in_shadow = 3;
  options.compensator.depth.max_beyond_range_m = 0.1;
  options.compensator.depth.min_off_middle_m = 0.05;
  options.compensator.depth.object_depth.min_half_width_m = 0.2;
  options.compensator.depth.object_depth.max_half_width_m = 0.3;
  options.compensator.depth.min_nearness = 2;
  options.compensator.depth.mask_margin_px = 4;
  options.compensator.depth.stale_age_s = 0.5;
  options.compensator.depth.motion_px_per_s = 100;
  HostFrame frame(0);
  const FrameStatistics expected =
      DynamicFilter(options).apply(frame.view(0), frame.segmentation, frame.keypoints).statistics();
  Plugin plugin(file);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
  EXPECT_GT(statistics.compensated, 0U);
  EXPECT_EQ(statistics.compensated, expected.compensated);
  EXPECT_EQ(statistics.instances.at(0).depth_range_m.lower,
            expected.instances.at(0).depth_range_m.lower);
}

TEST_F(PluginTest, RefusesWrongValuesByKey) {
  const std::pair<const char*, const char*> wrong[] = {
      {"margin_px: \"wide\"", "dynfilter.margin_px: got \"wide\"; want a number"},
      {"margin_px: -1", "margin_px = -1"},
      {"margin_per_diameter: [ 1 ]", "dynfilter.margin_per_diameter: got a list"},
      {"margin_per_diameter: -0.5", "margin_per_diameter = -0.5"},
      {"max_time_difference_s: -1.0", "dynfilter.max_time_difference_s: got -1; want at least 0"},
      {"max_time_difference_s: .inf", "dynfilter.max_time_difference_s: got "},
      {"remote_timeout_s: 0", "dynfilter.remote_timeout_s: got 0; want above 0"},
      {"max_time_difference_s: \"x\"", "dynfilter.max_time_difference_s: got \"x\""},
      {"box_margin_px: 1.5", "dynfilter.box_margin_px: got 1.5; want a whole number"},
      {"min_pixels: 0", "min_pixels = 0"},
      {"colour_order: \"gbr\"", "dynfilter.colour_order: got \"gbr\"; want one of bgr, rgb"},
      {"missing_masks: \"skip\"", "want one of error, keep"},
      {"rule: \"best\"", "dynfilter.rule: got \"best\"; want one of depth, paper, mask"},
      {"dynamic_classes: 0", "want a list of whole numbers"},
      {"dynamic_classes: [ 0, \"person\" ]", "dynfilter.dynamic_classes: got \"person\" in it"},
      {"static_mask: \"nowhere.png\"", "nowhere.png"},
      {"samples: 0", "samples = 0"},
      {"samples: -3", "dynfilter.samples: got -3; want a whole number from 0 to 2147483647"},
      {"seed: 1.5", "dynfilter.seed: got 1.5"},
      {"depth.outlier_rule: \"mean\"",
       "want one of median_absolute_deviation, interquartile_range"},
      {"depth.outlier_factor: -1", "outlier_factor = -1"},
      {"depth.min_samples: 0", "min_samples = 0"},
      {"depth.expansion: -0.1", "expansion = -0.1"},
      {"code.outlier_rule: 3", "dynfilter.code.outlier_rule: got 3"},
      {"code.outlier_factor: \"a\"", "dynfilter.code.outlier_factor: got \"a\""},
      {"code.min_samples: -1", "dynfilter.code.min_samples: got -1"},
      {"code.expansion: -16", "expansion = -16"},
      {"depth_lbp.missing_neighbour: \"far\"", "want one of nearer, farther"},
      {"missing_depth: \"drop\"", "want one of keep, remove"},
      {"floor: -1", "dynfilter.floor: got -1"},
      {"policy: \"none\"", "want one of report_only, restore_best_scored, restore_balanced"},
      {"output_folder: 5", "dynfilter.output_folder: got 5; want a text in quotes"},
      {"overlay_every: \"often\"", "dynfilter.overlay_every: got \"often\""},
  };
  for (const auto& [line, message] : wrong) {
    const std::string file = settings("dynfilter." + std::string(line) + "\n");
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, message);
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, "TUM3.yaml");
  }
}

TEST_F(PluginTest, NamesTheNearestKeyForAnUnknownOne) {
  const std::pair<const char*, const char*> misspelt[] = {
      {"margin: 3", "dynfilter.margin; the nearest is dynfilter.margin_px"},
      {"maskfolder: \"a\"", "the nearest is dynfilter.mask_folder"},
      {"depth.expanson: 1.0", "the nearest is dynfilter.depth.expansion"},
      {"Rule: \"paper\"", "the nearest is dynfilter.rule"},
      {"depth: 0.1", "the nearest is dynfilter.depth.outlier_rule"},
      {"most_wait_s: 1.0", "dynfilter.most_wait_s is called dynfilter.max_wait_s now"},
      {"object_depth.least_half_width_m: 1.0",
       "is called dynfilter.object_depth.min_half_width_m now"}};
  for (const auto& [line, message] : misspelt) {
    expect_error<std::runtime_error>(
        [&, wrong = line] { Plugin plugin(settings("dynfilter." + std::string(wrong) + "\n")); },
        message);
  }
}

TEST_F(PluginTest, NamesTheKeyForAMisspeltPrefix) {
  for (const char* key : {"Dynfilter.floor", "dynfilter_floor", "DYNFILTER-floor"}) {
    const std::string file = settings(std::string(key) + ": 501\n");
    expect_error<std::runtime_error>([&] { Plugin plugin(file); },
                                     std::string(key) + "; want dynfilter.floor");
  }
  // The settings of another camera, and a key of somebody else's.
  Plugin plugin(settings("dynfilter_right.floor: 501\ndynfilter_: 1\n"));
  EXPECT_TRUE(plugin.enabled());
}

/// Returns what a plugin with these settings says on standard error when it is made.
std::string said_of(const std::string& file) {
  ::testing::internal::CaptureStderr();
  const Plugin plugin(file);
  return ::testing::internal::GetCapturedStderr();
}

TEST_F(PluginTest, NamesSettingsWithoutEffect) {
  const std::string to_folder = "dynfilter.output_folder: \"" + path("out").string() + "\"\n";
  const struct {
    std::string line, need, with;  // the sentence ends with `need`; `with` gives it an effect
  } idle[] = {{"overlay_every: 30", "dynfilter.output_folder", to_folder},
              {"policy: \"restore_balanced\"", "dynfilter.floor above 0", "dynfilter.floor: 100\n"},
              {"max_wait_s: 0.1", "dynfilter.async: \"limited_wait\"",
               "dynfilter.async: \"limited_wait\"\n"},
              {"samples: 30", "dynfilter.rule: \"paper\"", "dynfilter.rule: \"paper\"\n"},
              {"code.expansion: 8", "dynfilter.rule: \"paper\"", "dynfilter.rule: \"paper\"\n"}};
  for (const auto& [line, need, with] : idle) {
    const std::string key = "dynfilter." + line.substr(0, line.find(':'));
    EXPECT_EQ(
        said_of(settings("dynfilter." + line + "\n")),
        "dynfilter: " + file().string() + ": " + key + " has no effect; it needs " + need + "\n");
    EXPECT_EQ(said_of(settings("dynfilter." + line + "\n" + with)), "");
  }
  EXPECT_NE(said_of(settings("dynfilter.rule: \"mask\"\ndynfilter.min_nearness: 1\n"))
                .find("dynfilter.min_nearness has no effect; it needs dynfilter.rule: \"depth\""),
            std::string::npos);
  EXPECT_NE(
      said_of(settings("dynfilter.rule: \"mask\"\ndynfilter.match_pairs: 1\n"))
          .find("dynfilter.match_pairs has no effect; it needs dynfilter.rule: \"depth\" or "),
      std::string::npos);
  EXPECT_NE(said_of(settings("dynfilter.match_pairs: 0\ndynfilter.min_depth_m: 1\n"))
                .find("dynfilter.min_depth_m has no effect; it needs dynfilter.match_pairs: 1"),
            std::string::npos);
  EXPECT_NE(said_of(settings("dynfilter.async: \"wait\"\ndynfilter.read_ahead: 1\n"))
                .find("dynfilter.read_ahead has no effect; it needs dynfilter.mask_folder and no "
                      "dynfilter.async"),
            std::string::npos);
  // With pairs, the rule "paper" takes the areas around objects from the options of "depth".
  for (const char* line :
       {"feature_reach_px: 30\n", "motion_px_per_s: 300\n", "stale_age_s: 1\n"}) {
    const std::string key = std::string("dynfilter.") + line;
    EXPECT_EQ(said_of(settings("dynfilter.rule: \"paper\"\n" + key)), "") << line;
    EXPECT_NE(said_of(settings("dynfilter.rule: \"mask\"\n" + key)), "") << line;
  }
}

TEST_F(PluginTest, TakesSettingsThatSayNothing) {
  EXPECT_EQ(said_of(settings("dynfilter.overlay_every: 0\ndynfilter.policy: \"report_only\"\n")),
            "");
  EXPECT_EQ(said_of(settings("dynfilter.min_nearness: 0.5\ndynfilter.min_pixels: 1\n")), "");
  EXPECT_EQ(said_of(settings("dynfilter.enabled: 0\ndynfilter.overlay_every: 30\n")), "");
}

TEST_F(PluginTest, ListsTheKeysIfThereIsNone) {
  for (const char* part :
       {"dynfilter.mask_folder: \"masks\"", "dynfilter.margin_px", "TUM3.yaml"}) {
    expect_error<std::runtime_error>([&] { Plugin plugin(raw_settings("")); }, part);
  }
  expect_error<std::runtime_error>([&] { Plugin plugin(raw_settings("dynfilter.margin_px: 1\n")); },
                                   "dynfilter.mask_folder");
}

TEST_F(PluginTest, NamesAnUnreadableFile) {
  expect_error<std::runtime_error>([&] { Plugin plugin(path("none.yaml").string()); }, "none.yaml");
  std::ofstream(path("bad.yaml")) << "this is: [ no yaml\n of: opencv";
  expect_error<std::runtime_error>([&] { Plugin plugin(path("bad.yaml").string()); }, "bad.yaml");
  expect_error<std::runtime_error>(
      [&] { Plugin plugin(raw_settings("dynfilter.mask_folder: \"no_such_folder\"\n")); },
      "no_such_folder");
}

}  // namespace
}  // namespace dynfilter::testing
