// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests the plugin in hosts that know the depth of features, but have no depth image.

#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>
#include <vector>

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/plugin.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

/// Frame of a rectified pair after matching: every third feature has no match.
struct StereoFrame : HostFrame {
  static constexpr float focal_baseline = 40;
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

TEST_F(PluginTest, SettingsOfTheFeaturesAroundArriveInTheFilter) {
  const auto compensated = [&](const std::string& lines) {
    Plugin plugin(settings(lines));
    return StereoFrame(0).filter_with(plugin).compensated;
  };
  const std::size_t by_default = compensated("");
  const std::size_t willing = compensated("dynfilter.min_feature_share: 0.5\n");
  EXPECT_GT(willing, by_default);
  EXPECT_LT(compensated("dynfilter.min_feature_share: 0.5\ndynfilter.feature_reach_px: 0\n"),
            willing);
  EXPECT_LT(compensated("dynfilter.min_feature_share: 0.5\ndynfilter.feature_doubt_px: 8\n"),
            willing);
  expect_error<std::runtime_error>([&] { compensated("dynfilter.min_feature_share: 2\n"); },
                                   "min_feature_share = 2");
}

TEST_F(PluginTest, StereoColumnsKeepTheirLengthWhereTheFilterIsOff) {
  Plugin plugin(raw_settings("dynfilter.enabled: 0\n"));
  StereoFrame frame(0);
  EXPECT_EQ(frame.filter_with(plugin).kept(), StereoFrame(0).keypoints.size());
  EXPECT_EQ(frame.keypoints.size(), StereoFrame(0).keypoints.size());
  frame.expect_in_step();
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

}  // namespace
}  // namespace dynfilter::testing
