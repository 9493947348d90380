// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests the plugin in hosts that know the depth of features, but have no depth image.

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/plugin.hpp"
#include "plugin/stereo_depths.hpp"
#include "support/host_frame.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Frame of a rectified pair after matching: every third feature has no match.
struct StereoFrame : HostFrame {
  static constexpr float focal_baseline = 31;
  std::vector<float> depths_m, right_x;
  std::vector<cv::KeyPoint> undistorted = keypoints;

  explicit StereoFrame(int index) : HostFrame(index) {
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const float metres = depth.at<float>(cv::Point(keypoints[i].pt));
      depths_m.push_back(i % 3 == 0 ? -1 : metres);
      right_x.push_back(i % 3 == 0 ? -1 : keypoints[i].pt.x - focal_baseline / metres);
      undistorted[i].pt.x += 0.25F;
    }
  }

  FrameStatistics filter_with(Plugin& plugin) {
    return plugin.filter(timestamp_s, depths_m, keypoints, descriptors, undistorted, right_x);
  }

  void expect_in_step() const {
    ASSERT_TRUE(in_step(*this));
    ASSERT_EQ(depths_m.size(), keypoints.size());
    ASSERT_EQ(right_x.size(), keypoints.size());
    ASSERT_EQ(undistorted.size(), keypoints.size());
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      ASSERT_EQ(undistorted[i].class_id, keypoints[i].class_id);
      const bool is_matched = keypoints[i].class_id % 3 != 0;
      ASSERT_EQ(right_x[i] != -1, is_matched);
      ASSERT_EQ(depths_m[i] != -1, is_matched);
      if (is_matched) {
        ASSERT_EQ(right_x[i], keypoints[i].pt.x - focal_baseline / depths_m[i]);
      }
    }
  }
};

TEST_F(PluginTest, StereoColumnsStayInStepAndMatchTheCore) {
  for (const CompensationRule rule : {CompensationRule::depth, CompensationRule::paper}) {
    Plugin plugin(settings(rule == CompensationRule::depth ? "" : "dynfilter.rule: \"paper\"\n"));
    DynamicFilterOptions options;
    options.compensator.rule = rule;
    const DynamicFilter core(options);
    for (int i = 0; i < frames; ++i) {
      StereoFrame frame(i);
      FrameView view = frame.view(static_cast<std::uint64_t>(i));
      view.depth = cv::Mat();
      const FeatureLabels labels = core.apply(
          view, frame.segmentation, FeaturesView(frame.keypoints).with_depths(frame.depths_m));
      if (i % 2 == 0) submit(plugin, i);  // without the right image
      const FrameStatistics statistics = frame.filter_with(plugin);
      EXPECT_EQ(statistics.masked, labels.statistics().masked);
      EXPECT_EQ(statistics.compensated, labels.statistics().compensated);
      EXPECT_GT(statistics.compensated, 0U);
      EXPECT_EQ(statistics.kept(), frame.keypoints.size());
      EXPECT_EQ(statistics.instances.at(0).compensation, Compensation::applied_without_image);
      frame.expect_in_step();
    }
  }
}

TEST_F(PluginTest, DepthsOfSomeFeaturesServeAMonoHost) {
  Plugin plugin(settings()), with_all_columns(settings());
  StereoFrame frame(0), expected(0);
  plugin.filter(frame.timestamp_s, frame.depths_m, frame.keypoints, frame.descriptors);
  expected.filter_with(with_all_columns);
  EXPECT_EQ(frame.depths_m, expected.depths_m);
  EXPECT_EQ(frame.keypoints.size(), expected.keypoints.size());
  EXPECT_TRUE(in_step(frame));
}

TEST_F(PluginTest, TellsAStereoHostAloneThatItHasNoMap) {
  for (const bool is_stereo : {true, false}) {
    Plugin plugin(settings("dynfilter.missing_masks: \"keep\"\n"));
    ::testing::internal::CaptureStderr();
    for (int i = 0; i < 30; ++i) {
      StereoFrame frame(i);
      if (is_stereo) {
        frame.filter_with(plugin);
      } else {
        plugin.filter(frame.timestamp_s, frame.depths_m, frame.keypoints, frame.descriptors);
      }
    }
    const std::string said = ::testing::internal::GetCapturedStderr();
    EXPECT_EQ(said.find("has not begun a map") != std::string::npos, is_stereo) << said;
  }
}

TEST_F(PluginTest, NamesAStereoColumnThatDoesNotFit) {
  Plugin plugin(settings());
  const auto refuses = [&](StereoFrame frame, const std::string& part) {
    const std::size_t keypoints = frame.keypoints.size();
    expect_error<std::invalid_argument>([&] { frame.filter_with(plugin); }, part);
    EXPECT_EQ(frame.keypoints.size(), keypoints);
  };
  StereoFrame depths(0), undistorted(0), right(0), same(0);
  depths.depths_m.pop_back();
  refuses(depths, "390 depths and 391 keypoints");
  undistorted.undistorted.pop_back();
  refuses(undistorted, "390 undistorted keypoints and 391 keypoints");
  right.right_x.push_back(0);
  refuses(right, "392 right coordinates and 391 keypoints");
  expect_error<std::invalid_argument>(
      [&] {
        plugin.filter(same.timestamp_s, same.depths_m, same.keypoints, same.descriptors,
                      same.keypoints, same.right_x);
      },
      "the same column twice");
  EXPECT_EQ(plugin.counters().filtered, 0U);
}

/// Frame of a host that matches a few features of the wall: both images say more.
struct PairFrame : StereoFrame {
  cv::Mat right;

  explicit PairFrame(int index) : StereoFrame(index) {
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      if (depths_m[i] > 2 && i % 30 == 1) continue;
      depths_m[i] = right_x[i] = -1;
    }
    cv::RNG random(7);
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    const cv::Rect person(20 + 3 * index, 20, 40, 80);
    const int wall_px = 10, person_px = 20;
    right = image.clone();
    image.colRange(wall_px, 160).copyTo(right.colRange(0, 160 - wall_px));
    cv::Mat surface(person.size(), CV_8UC3);
    random.fill(surface, cv::RNG::UNIFORM, 0, 256);
    surface.copyTo(image(person));
    surface.copyTo(right(person - cv::Point(person_px, 0)));
  }

  std::vector<float> pair_depths() const {
    cv::Mat left_grey, right_grey;
    cv::cvtColor(image, left_grey, cv::COLOR_BGR2GRAY);
    cv::cvtColor(right, right_grey, cv::COLOR_BGR2GRAY);
    std::vector<cv::Rect> areas;
    std::vector<float> depths = depths_m;
    Workspace workspace;
    stereo_areas(view(0), segmentation, MaskCuller(), areas);
    StereoDepths().find({left_grey, right_grey, focal_baseline}, keypoints, areas, depths,
                        workspace);
    for (std::size_t i = 0; i < depths.size(); ++i) {
      if (depths[i] == 0) depths[i] = depths_m[i];
    }
    return depths;
  }
};

std::size_t removed_with(Plugin& plugin, PairFrame frame) {
  const FrameStatistics statistics = frame.filter_with(plugin);
  EXPECT_TRUE(in_step(frame));
  EXPECT_EQ(frame.depths_m.size(), frame.keypoints.size());
  EXPECT_EQ(std::count_if(frame.depths_m.begin(), frame.depths_m.end(),
                          [](float depth_m) { return depth_m > 0 && depth_m < 2; }),
            0)
      << "the host's column keeps what the host knew";
  return statistics.compensated;
}

TEST_F(PluginTest, APairTellsDepthsThatTheHostLacks) {
  Plugin plugin(settings()), without(settings());
  const DynamicFilter core;
  for (int i = 0; i < frames; ++i) {
    const PairFrame frame(i);
    const std::vector<float> depths_m = frame.pair_depths();
    FrameView view = frame.view(static_cast<std::uint64_t>(i));
    view.depth = cv::Mat();
    const FeatureLabels labels =
        core.apply(view, frame.segmentation, FeaturesView(frame.keypoints).with_depths(depths_m));
    plugin.submit(frame.image, frame.right, frame.timestamp_s);
    without.submit(frame.image, frame.timestamp_s);
    const std::size_t compensated = removed_with(plugin, frame);
    EXPECT_EQ(compensated, labels.statistics().compensated);
    EXPECT_GT(compensated, removed_with(without, frame) + 10);
  }
  EXPECT_EQ(plugin.counters().never_submitted, 0U);
}

TEST_F(PluginTest, WhatTheHostMatchedStaysWhereThePairTellsNothing) {
  StereoFrame frame(0);  // plain images
  Plugin plugin(settings()), without(settings());
  plugin.submit(frame.image, frame.image, frame.timestamp_s);
  StereoFrame alone(0);
  const FrameStatistics by_host = alone.filter_with(without);
  EXPECT_GT(by_host.compensated, 0U);
  EXPECT_EQ(frame.filter_with(plugin).compensated, by_host.compensated);
}

TEST_F(PluginTest, APairMayHaveAnyTypeOfImages) {
  PairFrame frame(0);
  const auto removed = [&](const std::string& lines, int conversion) {
    cv::Mat left = frame.image, right = frame.right;
    if (conversion >= 0) {
      cv::cvtColor(frame.image, left, conversion);
      cv::cvtColor(frame.right, right, conversion);
    }
    Plugin plugin(settings(lines));
    plugin.submit(left, right, frame.timestamp_s);
    return removed_with(plugin, frame);
  };
  const std::size_t expected = removed("", -1);
  EXPECT_EQ(removed("", cv::COLOR_BGR2GRAY), expected);
  EXPECT_EQ(removed("", cv::COLOR_BGR2BGRA), expected);
  EXPECT_EQ(removed("dynfilter.colour_order: \"rgb\"\n", cv::COLOR_BGR2RGB), expected);
  EXPECT_EQ(removed("dynfilter.colour_order: \"rgb\"\n", cv::COLOR_BGR2RGBA), expected);
}

TEST_F(PluginTest, APairIsOfOneFrame) {
  PairFrame first(0), second(1);
  Plugin plugin(settings()), without(settings());
  plugin.submit(first.image, first.right, first.timestamp_s);
  plugin.submit(second.image, second.timestamp_s);
  EXPECT_EQ(removed_with(plugin, second), removed_with(without, second));
  plugin.submit(first.image, first.right, first.timestamp_s);  // and another frame is filtered
  EXPECT_EQ(removed_with(plugin, second), removed_with(without, second));
  EXPECT_GT(removed_with(plugin, first), removed_with(without, first)) << "it is still there";
  EXPECT_GT(removed_with(plugin, first), removed_with(without, first)) << "for the frame again";
}

TEST_F(PluginTest, SettingsOfThePairArrive) {
  const PairFrame frame(0);
  const auto removed = [&](const std::string& lines) {
    Plugin plugin(settings(lines));
    plugin.submit(frame.image, frame.right, frame.timestamp_s);
    return removed_with(plugin, frame);
  };
  Plugin without(settings());
  const std::size_t by_host = removed_with(without, frame);
  EXPECT_GT(removed(""), by_host);
  EXPECT_LT(removed("dynfilter.min_depth_m: 2\n"), removed(""));  // the person is nearer
  EXPECT_GT(removed("dynfilter.rule: \"paper\"\n"), 0U);
  EXPECT_EQ(removed("dynfilter.rule: \"mask\"\n"), 0U);
  EXPECT_EQ(removed("dynfilter.dynamic_classes: [ 7 ]\n"), 0U);
  expect_error<std::runtime_error>([&] { removed("dynfilter.min_depth_m: 0\n"); },
                                   "dynfilter.min_depth_m: got 0; want above 0");
}

TEST_F(PluginTest, RefusesAnUnequalPair) {
  Plugin plugin(settings()), off(raw_settings("dynfilter.enabled: 0\n"));
  const PairFrame frame(0);
  expect_error<std::invalid_argument>(
      [&] { plugin.submit(frame.image, frame.right.colRange(0, 159), 1); }, "160x120 and 159x120");
  for (const cv::Mat& wrong :
       {cv::Mat(), cv::Mat(image_size, CV_32FC1), cv::Mat({2, 120, 160}, CV_8UC1)}) {
    expect_error<std::invalid_argument>([&] { plugin.submit(frame.image, wrong, 1); },
                                        "CV_8UC1, CV_8UC3 or CV_8UC4");
    expect_error<std::invalid_argument>([&] { plugin.submit(wrong, frame.right, 1); },
                                        "Plugin::submit");
    off.submit(frame.image, wrong, 1);
  }
  EXPECT_EQ(plugin.counters().submitted, 0U);
  EXPECT_EQ(off.counters().submitted, 3U);
}

}  // namespace
}  // namespace dynfilter::testing
