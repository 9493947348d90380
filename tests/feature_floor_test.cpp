// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/feature_floor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>

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

/// Restores exactly as many as are missing, for any order of the features; kept features stay.
TEST(FeatureFloor, HoldsItsInvariantsOnArbitraryInput) {
  std::size_t starved = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source);
    const FeatureLabels before =
        DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
    FeatureFloorOptions& floor = input.options.feature_floor;
    floor.floor = static_cast<std::size_t>(source.between(0, 130));
    floor.policy =
        source.chance(50) ? FloorPolicy::restore_balanced : FloorPolicy::restore_best_scored;
    const FeatureLabels after =
        DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
    std::size_t restorable = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      restorable +=
          before.is_removed(i) && (before[i].instance >= 0 || before[i].reason != Reason::in_mask);
      ASSERT_TRUE(before.is_removed(i) || same_label(before[i], after[i])) << "seed " << seed;
    }
    const std::size_t kept = before.statistics().kept();
    const std::size_t missing = floor.floor > kept ? floor.floor - kept : 0;
    ASSERT_EQ(after.statistics().restored, std::min(missing, restorable)) << "seed " << seed;
    ASSERT_EQ(after.statistics().starved, missing > 0);
    starved += missing > 0 ? 1 : 0;

    std::reverse(input.keypoints.begin(), input.keypoints.end());
    const FeatureLabels reversed =
        DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
    // Features of one pixel are interchangeable: compare how many of each pixel are kept.
    std::map<std::pair<int, int>, int> balance;
    for (std::size_t i = 0; i < after.size(); ++i) {
      const cv::Point pixel = FeaturesView(input.keypoints).pixel(i);
      const std::size_t j = after.size() - 1 - i;
      balance[{pixel.x, pixel.y}] +=
          (reversed.is_removed(i) ? 1 : 0) - (after.is_removed(j) ? 1 : 0);
    }
    for (const auto& [pixel, difference] : balance) ASSERT_EQ(difference, 0) << "seed " << seed;
  }
  EXPECT_GT(starved, 300U);
}

}  // namespace
}  // namespace dynfilter::testing
