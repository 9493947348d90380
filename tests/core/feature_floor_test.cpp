// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/feature_floor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

/// Frame of 800x600 (cells of 100x100) with features, some of them removed.
struct Frame {
  FrameView view;
  Segmentation segmentation;
  std::vector<cv::Point2f> points;
  FeatureLabels labels;

  explicit Frame(std::vector<cv::Point2f> features) : points(std::move(features)) {
    segmentation.image_size = {800, 600};
    segmentation.instances.resize(2);
    labels.reset(points.size(), segmentation);
  }

  void apply(std::size_t floor, FloorPolicy policy) {
    FeatureFloorOptions options;
    options.floor = floor;
    options.policy = policy;
    FeatureFloor stage(options);
    stage({view, segmentation, points}, labels);
  }

  std::vector<std::size_t> restored() const {
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (labels[i].reason == Reason::restored) indices.push_back(i);
    }
    return indices;
  }
};

std::vector<cv::Point2f> points_in_a_row(int count) {
  std::vector<cv::Point2f> points;
  for (int i = 0; i < count; ++i) points.emplace_back(static_cast<float>(i), 5.0F);
  return points;
}

TEST(FeatureFloor, DoesNothingIfEnoughFeaturesAreLeft) {
  Frame frame(points_in_a_row(10));
  for (std::size_t i = 0; i < 4; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  frame.apply(6, FloorPolicy::restore_best_scored);
  EXPECT_FALSE(frame.labels.statistics().starved);
  EXPECT_EQ(frame.labels.statistics().suggested_features, 0U);
  EXPECT_TRUE(frame.restored().empty());
}

TEST(FeatureFloor, ReportsStarvationAndSuggestsAFeatureCount) {
  Frame frame(points_in_a_row(10));
  for (std::size_t i = 0; i < 6; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  frame.apply(5, FloorPolicy::report_only);
  EXPECT_TRUE(frame.labels.statistics().starved);
  EXPECT_EQ(frame.labels.statistics().kept(), 4U) << "the policy report restores nothing";
  EXPECT_EQ(frame.labels.statistics().suggested_features, 13U);  // 5 / 0.4
  frame.labels.reset(10, frame.segmentation);
  for (std::size_t i = 0; i < 10; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  frame.apply(5, FloorPolicy::report_only);
  EXPECT_EQ(frame.labels.statistics().suggested_features, 40U) << "at most four times as many";
}

TEST(FeatureFloor, RestoresLowScoresFirstThenCompensatedFeatures) {
  Frame frame(points_in_a_row(8));
  const float scores[] = {0.9F, 0.8F, 0.3F, 0.8F, 0.5F, 0.8F};
  for (std::size_t i = 0; i < 6; ++i) {
    frame.labels.remove(i, 1, i == 3 ? Reason::compensated : Reason::in_mask, scores[i]);
  }
  frame.apply(5, FloorPolicy::restore_best_scored);
  EXPECT_EQ(frame.restored(), (std::vector<std::size_t>{2, 3, 4}));
  EXPECT_TRUE(frame.labels.statistics().starved) << "restored features were missing before";
  EXPECT_EQ(frame.labels.statistics().restored, 3U);
  EXPECT_EQ(frame.labels.statistics().kept(), 5U);
  EXPECT_EQ(frame.labels[2].instance, 1);
  EXPECT_EQ(frame.labels[2].score, 0.3F);
}

TEST(FeatureFloor, RestoresInEmptyCellsFirst) {
  std::vector<cv::Point2f> points;
  for (int i = 0; i < 20; ++i) points.emplace_back(50.0F, 50.0F + static_cast<float>(i));
  for (int i = 0; i < 20; ++i) points.emplace_back(750.0F, 550.0F + static_cast<float>(i));
  Frame frame(points);
  for (std::size_t i = 10; i < 40; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  // The first cell keeps 10 features; the last one keeps none, so it is filled first.
  frame.apply(18, FloorPolicy::restore_balanced);
  for (const std::size_t i : frame.restored()) EXPECT_GE(i, 20U);
  EXPECT_EQ(frame.restored().size(), 8U);
  frame.apply(26, FloorPolicy::restore_balanced);
  const std::vector<std::size_t> restored = frame.restored();
  EXPECT_EQ(restored.size(), 16U);
  EXPECT_EQ(std::count_if(restored.begin(), restored.end(), [](std::size_t i) { return i < 20; }),
            3)
      << "13 each";
}

TEST(FeatureFloor, TakesTheSizeOfTheImageIfMasksAreUnknown) {
  std::vector<cv::Point2f> points = points_in_a_row(10);
  points.emplace_back(750.0F, 550.0F);
  Frame frame(points);
  frame.segmentation = {};
  frame.view.image = cv::Mat(600, 800, CV_8UC1);
  frame.labels.reset(points.size(), frame.segmentation);
  for (std::size_t i = 5; i < 11; ++i) {
    frame.labels.remove(i, -1, Reason::custom, i < 10 ? 0.1F : 0.9F);
  }
  frame.apply(6, FloorPolicy::restore_balanced);
  EXPECT_EQ(frame.restored(), std::vector<std::size_t>{10});
}

TEST(FeatureFloor, RestoresByScoreIfNoImageSizeIsKnown) {
  Frame frame(points_in_a_row(4));
  frame.segmentation = {};
  frame.labels.reset(4, frame.segmentation);
  for (std::size_t i = 0; i < 4; ++i) {
    frame.labels.remove(i, -1, Reason::custom, 0.9F - 0.1F * static_cast<float>(i));
  }
  frame.apply(2, FloorPolicy::restore_balanced);
  EXPECT_EQ(frame.restored(), (std::vector<std::size_t>{2, 3}));
}

TEST(FeatureFloor, NeverRestoresFeaturesOnTheStaticMask) {
  Frame frame(points_in_a_row(4));
  for (std::size_t i = 0; i < 3; ++i) frame.labels.remove(i, -1, Reason::in_mask, 1.0F);
  frame.labels.remove(3, -1, Reason::custom, 1.0F);
  frame.apply(4, FloorPolicy::restore_best_scored);
  EXPECT_EQ(frame.restored(), std::vector<std::size_t>{3});
}

FilterCase case_with_floor(std::uint64_t seed) {
  ByteSource source(seed);
  FilterCase input = arbitrary_case_of_any_rule(source);
  draw_floor(source, input);
  return input;
}

FeatureLabels labels_of(const FilterCase& input) {
  return DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
}

TEST(FeatureFloor, MatchesANaiveReference) {
  std::size_t starved = 0, restored = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    const FilterCase input = case_with_floor(seed);
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    FilterCase without = input;
    without.options.feature_floor = {};
    const std::size_t kept = labels_of(without).statistics().kept();
    const FeatureLabels labels = labels_of(input);
    ASSERT_EQ(labels.statistics().starved, kept < input.options.feature_floor.floor);
    starved += labels.statistics().starved ? 1 : 0;
    restored += labels.statistics().restored;
  }
  EXPECT_GT(starved, 300U);
  EXPECT_GT(restored, 300U);
}

/// Only features that agree in everything that the filter knows are interchangeable.
TEST(FeatureFloor, DoesNotDependOnTheOrderOfTheFeatures) {
  std::size_t restored = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    FilterCase input = case_with_floor(seed);
    std::map<std::array<std::uint32_t, 3>, int> balance;
    const auto count = [&](const FeatureLabels& labels, int change) {
      for (std::size_t i = 0; i < labels.size(); ++i) {
        balance[bits_of(input.keypoints[i])] += labels.is_removed(i) ? change : 0;
      }
    };
    count(labels_of(input), 1);
    std::reverse(input.keypoints.begin(), input.keypoints.end());
    const FeatureLabels reversed = labels_of(input);
    count(reversed, -1);
    for (const auto& [bits, difference] : balance) ASSERT_EQ(difference, 0) << "seed " << seed;
    restored += reversed.statistics().restored;
  }
  EXPECT_GT(restored, 300U);
}

TEST(FeatureFloor, TellsFeaturesOfOnePixelApart) {
  for (const bool turned : {false, true}) {
    std::vector<cv::Point2f> points = {{120.2F, 120.1F}, {119.8F, 120.3F}};
    if (turned) std::swap(points[0], points[1]);
    Frame frame(points);
    for (std::size_t i = 0; i < 2; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
    frame.apply(1, FloorPolicy::restore_best_scored);
    ASSERT_EQ(frame.restored().size(), 1U);
    EXPECT_EQ(frame.points[frame.restored()[0]].x, 119.8F);
  }
}

}  // namespace
}  // namespace dynfilter::testing
