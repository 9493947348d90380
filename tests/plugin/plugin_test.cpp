// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/plugin.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "support/expect_error.hpp"
#include "support/filter_property.hpp"
#include "support/host_frame.hpp"
#if defined(__linux__)
#include "support/remote_peer.hpp"
#endif
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

TEST_F(PluginTest, LabelsMatchTheCore) {
  Plugin plugin(settings("dynfilter.margin_px: 1.5\ndynfilter.seed: 7\n"));
  DynamicFilterOptions options;
  options.mask_culler.margin_px = 1.5;
  options.compensator.paper.seed = 7;
  const DynamicFilter core(options);
  for (int i = 0; i < frames; ++i) {
    HostFrame frame(i);
    HostFrame expected(i);
    const FeatureLabels labels = core.apply(expected.view(static_cast<std::uint64_t>(i)),
                                            expected.segmentation, expected.keypoints);
    keep_static(labels, expected.keypoints, expected.descriptors);

    plugin.submit(frame.image, frame.timestamp_s);
    const FrameStatistics statistics =
        plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
    EXPECT_EQ(statistics.masked, labels.statistics().masked);
    EXPECT_EQ(statistics.compensated, labels.statistics().compensated);
    EXPECT_GT(statistics.masked, 0U);
    EXPECT_GT(statistics.compensated, 0U);
    ASSERT_EQ(frame.keypoints.size(), expected.keypoints.size());
    for (std::size_t k = 0; k < frame.keypoints.size(); ++k) {
      ASSERT_EQ(frame.keypoints[k].class_id, expected.keypoints[k].class_id)
          << "the order must stay";
    }
    EXPECT_TRUE(in_step(frame));
  }
  EXPECT_EQ(plugin.counters().filtered, static_cast<std::size_t>(frames));
  EXPECT_EQ(plugin.counters().never_submitted, 0U);
}

TEST_F(PluginTest, AcceptsRawDepthInUnitsOfTheSettingsFile) {
  Plugin of_metres(settings()), of_units(settings());
  HostFrame metres(0), units(0);
  cv::Mat raw;
  units.depth.convertTo(raw, CV_16UC1, 5000);
  of_metres.filter(metres.timestamp_s, metres.depth, metres.keypoints, metres.descriptors);
  of_units.filter(units.timestamp_s, raw, units.keypoints, units.descriptors);
  EXPECT_EQ(metres.keypoints.size(), units.keypoints.size());
  EXPECT_LT(metres.keypoints.size(), HostFrame(0).keypoints.size());
}

TEST_F(PluginTest, MonoUsesMasksOnly) {
  Plugin plugin(settings());
  HostFrame frame(0);
  plugin.submit(frame.image, frame.timestamp_s);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.keypoints, frame.descriptors);
  EXPECT_GT(statistics.masked, 0U);
  EXPECT_EQ(statistics.compensated, 0U);
  EXPECT_FALSE(statistics.has_depth);
  EXPECT_TRUE(in_step(frame));
}

TEST_F(PluginTest, KeepsTheReversedOrderOfOrbSlam3Mono) {
  Plugin plugin(settings());
  HostFrame frame(0);
  std::reverse(frame.keypoints.begin(), frame.keypoints.end());
  cv::flip(frame.descriptors, frame.descriptors, 0);
  plugin.submit(frame.image, frame.timestamp_s);
  plugin.filter(frame.timestamp_s, frame.keypoints, frame.descriptors);
  EXPECT_TRUE(in_step(frame));
  for (std::size_t i = 1; i < frame.keypoints.size(); ++i) {
    EXPECT_GT(frame.keypoints[i - 1].class_id, frame.keypoints[i].class_id);
  }
}

TEST_F(PluginTest, TwoCamerasAdjustTheirOwnPivots) {
  const std::string file = settings("dynfilter_right.mask_folder: \"" + masks().string() + "\"\n");
  Plugin left(file), right(file, "dynfilter_right");
  HostFrame frame(0), other(0);
  for (const int pivot : {0, 1, 100, static_cast<int>(frame.keypoints.size())}) {
    HostFrame at_left(0), at_right(0);
    left.submit(at_left.image, at_left.timestamp_s);
    right.submit(at_right.image, at_right.timestamp_s);
    int mono_left = pivot, mono_right = pivot;
    left.filter(at_left.timestamp_s, at_left.keypoints, at_left.descriptors, mono_left);
    right.filter(at_right.timestamp_s, at_right.keypoints, at_right.descriptors, mono_right);
    int expected = 0;
    for (const cv::KeyPoint& keypoint : at_left.keypoints) expected += keypoint.class_id < pivot;
    EXPECT_EQ(mono_left, expected);
    EXPECT_EQ(mono_right, expected);
  }
  int beyond = 100000;
  expect_error<std::invalid_argument>(
      [&] { left.filter(frame.timestamp_s, frame.keypoints, frame.descriptors, beyond); },
      "pivot 100000");
}

TEST_F(PluginTest, TwoPluginsShareNothing) {
  Plugin strict(settings("dynfilter.margin_px: 8\n"));
  Plugin loose(settings("dynfilter.rule: \"mask\"\n"));
  HostFrame first(0), second(0);
  strict.submit(first.image, first.timestamp_s);
  const auto of_loose =
      loose.filter(second.timestamp_s, second.depth, second.keypoints, second.descriptors);
  const auto of_strict =
      strict.filter(first.timestamp_s, first.depth, first.keypoints, first.descriptors);
  EXPECT_GT(of_strict.masked, of_loose.masked);
  EXPECT_EQ(of_loose.compensated, 0U);
  EXPECT_EQ(strict.counters().never_submitted, 0U);
  EXPECT_EQ(loose.counters().never_submitted, 1U);
}

TEST_F(PluginTest, KeepsAtLeastOneFeature) {
  Plugin plugin(settings());
  HostFrame frame(0);
  std::vector<cv::KeyPoint> on_person = {{30, 30, 31}, {31, 31, 31}};
  cv::Mat descriptors = frame.descriptors.rowRange(0, 2).clone();
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.depth, on_person, descriptors);
  EXPECT_EQ(on_person.size(), 1U);
  EXPECT_EQ(descriptors.rows, 1);
  EXPECT_EQ(statistics.restored, 1U);
  std::vector<cv::KeyPoint> nothing;
  cv::Mat no_descriptors;
  EXPECT_EQ(plugin.filter(frame.timestamp_s, frame.depth, nothing, no_descriptors).features, 0U);
}

TEST_F(PluginTest, RestoresUpToTheFloorAndReportsStarvation) {
  Plugin plugin(settings("dynfilter.floor: 350\ndynfilter.policy: \"restore_balanced\"\n"));
  HostFrame frame(0);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
  EXPECT_TRUE(statistics.starved);
  EXPECT_GT(statistics.suggested_features, HostFrame(0).keypoints.size());
  EXPECT_EQ(frame.keypoints.size(), 350U);
  EXPECT_TRUE(in_step(frame));
  EXPECT_EQ(plugin.counters().starved, 1U);
}

TEST_F(PluginTest, CountsUnpairedCalls) {
  Plugin plugin(settings());
  HostFrame first(0), second(1);
  plugin.submit(first.image, first.timestamp_s);
  plugin.submit(second.image, second.timestamp_s);  // the first is never filtered
  plugin.filter(first.timestamp_s, first.depth, first.keypoints, first.descriptors);
  EXPECT_EQ(plugin.counters().submitted, 2U);
  EXPECT_EQ(plugin.counters().never_filtered, 1U);
  EXPECT_EQ(plugin.counters().never_submitted, 1U) << "the submitted image has another time";
  plugin.filter(second.timestamp_s, second.depth, second.keypoints, second.descriptors);
  EXPECT_EQ(plugin.counters().never_submitted, 1U);
  EXPECT_EQ(plugin.counters().filtered, 2U);
}

TEST_F(PluginTest, MissingMaskThrowsOrIsCounted) {
  Plugin strict(settings());
  HostFrame late(50);
  const std::size_t before = late.keypoints.size();
  expect_error<std::runtime_error>(
      [&] { strict.filter(late.timestamp_s, late.depth, late.keypoints, late.descriptors); },
      "105.000000.png");
  EXPECT_EQ(late.keypoints.size(), before) << "an error must not change the frame";
  EXPECT_TRUE(in_step(late));

  Plugin lenient(settings("dynfilter.missing_masks: \"keep\"\n"));
  const FrameStatistics statistics =
      lenient.filter(late.timestamp_s, late.depth, late.keypoints, late.descriptors);
  EXPECT_FALSE(statistics.has_segmentation);
  EXPECT_EQ(late.keypoints.size(), before);
  EXPECT_EQ(lenient.counters().without_masks, 1U);
}

TEST_F(PluginTest, KeepsFeaturesWithoutMasksOnRequest) {
  const std::string file = settings("dynfilter.missing_masks: \"keep\"\n");
  HostFrame first(0), second(1);
  fs::remove(masks() / "100.000000.png");  // its row stays in the table
  Plugin one_missing(file);
  EXPECT_FALSE(
      one_missing.filter(100.0, first.depth, first.keypoints, first.descriptors).has_segmentation);
  EXPECT_TRUE(one_missing.filter(100.1, second.depth, second.keypoints, second.descriptors)
                  .has_segmentation);

  fs::remove_all(masks());
  fs::create_directory(masks());
  HostFrame third(2);
  Plugin all_missing(file);
  EXPECT_FALSE(
      all_missing.filter(100.2, third.depth, third.keypoints, third.descriptors).has_segmentation);
  EXPECT_EQ(all_missing.counters().without_masks, 1U);
}

TEST_F(PluginTest, NamesMalformedInput) {
  Plugin plugin(settings());
  HostFrame frame(0);
  const auto filter = [&](const cv::Mat& depth, cv::Mat descriptors) {
    plugin.filter(frame.timestamp_s, depth, frame.keypoints, descriptors);
  };
  expect_error<std::invalid_argument>(
      [&] { filter(frame.depth, frame.descriptors.rowRange(0, 5)); }, "5 descriptors");
  expect_error<std::invalid_argument>(
      [&] { filter(cv::Mat::zeros(image_size, CV_8UC1), frame.descriptors); }, "CV_8UC1");
  expect_error<std::runtime_error>(
      [&] { filter(cv::Mat(60, 80, CV_32FC1, cv::Scalar(1)), frame.descriptors); }, "80x60");
  expect_error<std::invalid_argument>([&] { plugin.submit(cv::Mat(), 1.0); }, "Plugin::submit");
  expect_error<std::invalid_argument>([&] { plugin.submit(cv::Mat::zeros(4, 4, CV_32FC1), 1.0); },
                                      "CV_32FC1");
  expect_error<std::invalid_argument>([&] { plugin.submit(frame.image, std::nan("")); }, "nan");
  plugin.submit(cv::Mat::zeros(60, 80, CV_8UC3), frame.timestamp_s);
  expect_error<std::invalid_argument>([&] { filter(frame.depth, frame.descriptors); }, "80x60");
  EXPECT_TRUE(in_step(frame));
  EXPECT_EQ(frame.keypoints.size(), HostFrame(0).keypoints.size());
}

TEST_F(PluginTest, MonoNeedsNoImageForMasksFromAFolder) {
  Plugin with(settings()), without(settings());
  HostFrame first(0), second(0);
  with.submit(first.image, first.timestamp_s);
  with.filter(first.timestamp_s, first.keypoints, first.descriptors);
  const FrameStatistics statistics =
      without.filter(second.timestamp_s, second.keypoints, second.descriptors);
  EXPECT_GT(statistics.masked, 0U);
  EXPECT_EQ(second.keypoints.size(), first.keypoints.size());
  EXPECT_EQ(without.counters().never_submitted, 1U);
}

TEST_F(PluginTest, RecordsFramesAndOverlaysOnRequest) {
  Plugin plugin(settings("dynfilter.output_folder: \"" + path("out").string() +
                         "\"\ndynfilter.overlay_every: 3\n"));
  for (int i = 0; i < frames; ++i) {
    HostFrame frame(i);
    plugin.submit(frame.image, frame.timestamp_s);
    plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
    std::ifstream table(path("out") / "frames.csv");
    int lines = 0;
    for (std::string line; std::getline(table, line);) ++lines;
    EXPECT_EQ(lines, i + 2) << "the file is complete while the host runs";
  }
  EXPECT_TRUE(fs::exists(path("out") / "overlays" / "100.000000.png"));
  EXPECT_TRUE(fs::exists(path("out") / "overlays" / "100.300000.png"));
  EXPECT_FALSE(fs::exists(path("out") / "overlays" / "100.100000.png"));
}

TEST_F(PluginTest, IgnoresAFourthChannel) {
  std::vector<std::vector<uchar>> overlays;
  for (const char* name : {"three", "four"}) {
    Plugin plugin(settings("dynfilter.output_folder: \"" + path(name).string() +
                           "\"\ndynfilter.overlay_every: 1\n"));
    HostFrame frame(0);
    cv::Mat image = frame.image;
    if (std::string(name) == "four") {
      std::vector<cv::Mat> channels;
      cv::split(image, channels);
      channels.emplace_back(image.size(), CV_8UC1, cv::Scalar(77));
      cv::merge(channels, image);
    }
    plugin.submit(image, frame.timestamp_s);
    plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
    const cv::Mat overlay = cv::imread((path(name) / "overlays" / "100.000000.png").string());
    ASSERT_FALSE(overlay.empty());
    overlays.emplace_back(overlay.datastart, overlay.dataend);
  }
  EXPECT_EQ(overlays[0], overlays[1]);
}

TEST_F(PluginTest, CanBeMoved) {
  Plugin first(settings());
  Plugin second(std::move(first));
  HostFrame frame(0);
  EXPECT_GT(
      second.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors).masked, 0U);
}

// --- Settings ------------------------------------------------------------------------------------

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
      "dynfilter.mask_margin_px: 4\ndynfilter.stale_age_s: 0.5\ndynfilter.motion_px_per_s: 100\n");
  DynamicFilterOptions options;
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
      {"max_time_difference_s: -1.0", "max_time_difference_s = -1"},
      {"max_time_difference_s: \"x\"", "dynfilter.max_time_difference_s: got \"x\""},
      {"box_margin_px: 1.5", "dynfilter.box_margin_px: got 1.5; want a whole number"},
      {"min_pixels: 0", "min_pixels = 0"},
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
      {"most_wait_s: 1.0", "dynfilter.most_wait_s is called dynfilter.max_wait_s now"},
      {"object_depth.least_half_width_m: 1.0",
       "is called dynfilter.object_depth.min_half_width_m now"}};
  for (const auto& [line, message] : misspelt) {
    expect_error<std::runtime_error>(
        [&, wrong = line] { Plugin plugin(settings("dynfilter." + std::string(wrong) + "\n")); },
        message);
  }
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

/// Class ids of the keypoints that the plugin keeps in frames 0, 1, …
std::vector<std::vector<int>> kept_in_frames(Plugin& plugin, int count) {
  std::vector<std::vector<int>> left;
  for (int i = 0; i < count; ++i) {
    HostFrame frame(i);
    plugin.submit(frame.image, frame.timestamp_s);
    plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
    EXPECT_TRUE(in_step(frame));
    left.emplace_back();
    for (const cv::KeyPoint& keypoint : frame.keypoints) left.back().push_back(keypoint.class_id);
  }
  return left;
}

TEST_F(PluginTest, AsyncWaitMatchesSynchronous) {
  Plugin without(settings()), with(settings("dynfilter.async: \"wait\"\n"));
  EXPECT_EQ(kept_in_frames(with, frames), kept_in_frames(without, frames));
  EXPECT_EQ(with.counters().without_masks, 0U);
}

TEST_F(PluginTest, AsyncFiltersFramesNeverSubmitted) {
  Plugin plugin(settings("dynfilter.async: \"wait\"\n"));
  HostFrame frame(0);
  EXPECT_GT(plugin.filter(frame.timestamp_s, frame.keypoints, frame.descriptors).masked, 0U);
  EXPECT_EQ(plugin.counters().never_submitted, 1U);
}

TEST_F(PluginTest, AsyncFiltersAFrameTwice) {
  Plugin plugin(settings("dynfilter.async: \"wait\"\n"));
  HostFrame first(0), again(0);
  plugin.submit(first.image, first.timestamp_s);
  plugin.filter(first.timestamp_s, first.depth, first.keypoints, first.descriptors);
  plugin.filter(again.timestamp_s, again.depth, again.keypoints, again.descriptors);
  EXPECT_EQ(again.keypoints.size(), first.keypoints.size());
}

TEST_F(PluginTest, PropagationToTheSameFrameChangesNothing) {
  Plugin without(settings()), with(settings("dynfilter.propagate: \"yes\"\n"));
  EXPECT_EQ(kept_in_frames(with, frames), kept_in_frames(without, frames));
}

TEST_F(PluginTest, PropagationBridgesAFrameWithoutAMask) {
  const char* keep = "dynfilter.missing_masks: \"keep\"\n";
  Plugin without(settings(keep));
  Plugin with(settings(std::string(keep) + "dynfilter.propagate: \"yes\"\n"));
  const std::size_t all = HostFrame(frames).keypoints.size();
  EXPECT_EQ(kept_in_frames(without, frames + 1).back().size(), all);
  EXPECT_LT(kept_in_frames(with, frames + 1).back().size(), all);
}

void refuses_file(const std::string& file, const std::string& part) {
  expect_error<std::runtime_error>([&] { Plugin plugin(file); }, part);
}

TEST_F(PluginTest, NeedsExactlyOneSourceOfMasks) {
  refuses_file(raw_settings("dynfilter.floor: 3\n"), "dynfilter.mask_folder: got nothing");
  refuses_file(settings("dynfilter.async: \"late\"\n"), "dynfilter.async: got");
  refuses_file(settings("dynfilter.propagate: 1\n"), "dynfilter.propagate: got");
  refuses_file(settings("dynfilter.async: \"wait_at_most\"\ndynfilter.max_wait_s: -1\n"),
               "max_wait_s = -1");
#if defined(__linux__)
  refuses_file(settings("dynfilter.remote: \"socket\"\n"), "got mask_folder and remote");
#endif
}

#ifdef DYNFILTER_HAS_NETWORKS
TEST_F(PluginTest, NamesANetworkThatCannotBeLoaded) {
  refuses_file(raw_settings("dynfilter.model: \"no_such.onnx\"\n"), "no_such.onnx");
  refuses_file(settings("dynfilter.model: \"no_such.onnx\"\n"), "got mask_folder and model");
}
#endif

#if defined(__linux__)
std::string remote_settings(const fs::path& socket) {
  return "dynfilter.remote: \"" + socket.string() + "\"\ndynfilter.remote_timeout_s: 20\n";
}

TEST_F(PluginTest, UsesMasksFromAnotherProcess) {
  const RemotePeer peer(path("socket"), [](const PeerSocket& socket, const ReceivedFrame& frame) {
    EXPECT_EQ(frame.image.size(), image_size);
    HostFrame known(static_cast<int>(std::lround((frame.timestamp_s - 100) / 0.1)));
    known.segmentation.frame_id = frame.id;
    return socket.send(reply(frame.request, known.segmentation));
  });
  Plugin folder(settings());
  const auto expected = kept_in_frames(folder, frames);
  for (const char* thread : {"", "dynfilter.async: \"wait\"\n"}) {
    Plugin remote(raw_settings(remote_settings(path("socket")) + thread));
    EXPECT_EQ(kept_in_frames(remote, frames), expected) << thread;
  }
}

TEST_F(PluginTest, WithoutAListenerItFailsOrContinuesAsConfigured) {
  Plugin strict(raw_settings(remote_settings(path("nobody"))));
  HostFrame frame(0);
  strict.submit(frame.image, frame.timestamp_s);
  expect_error<std::runtime_error>(
      [&] { strict.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors); },
      path("nobody").string());
  EXPECT_EQ(frame.keypoints.size(), HostFrame(0).keypoints.size());
  EXPECT_EQ(strict.counters().mask_failures, 0U);

  const char* keep = "dynfilter.missing_masks: \"keep\"\n";
  for (const char* thread : {"", "dynfilter.async: \"wait\"\n"}) {
    Plugin lenient(raw_settings(remote_settings(path("nobody")) + keep + thread));
    EXPECT_EQ(kept_in_frames(lenient, 3).back().size(), frame.keypoints.size()) << thread;
    EXPECT_EQ(lenient.counters().mask_failures, 3U) << thread;
    EXPECT_EQ(lenient.counters().without_masks, 3U) << thread;
  }
}
#endif

}  // namespace
}  // namespace dynfilter::testing
