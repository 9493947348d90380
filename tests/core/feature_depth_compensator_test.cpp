// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests both rules on features that have a column of depths.

#include "dynfilter/feature_depth_compensator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

/// Makes the depths of the features on masks unknown, as of a host that has none there.
void forget_masked_depths(FilterCase& input) {
  for (std::size_t i = 0; i < input.keypoints.size(); ++i) {
    for (const Instance& instance : input.segmentation.instances) {
      if (!oracle_on_mask(instance, oracle_pixel(input.keypoints[i].pt), 0)) continue;
      input.depths_m->at(i) = 0;
    }
  }
}

/// Random case of a rule, whose features have depths and whose frame has no depth image.
FilterCase column_case(std::uint64_t seed, CompensationRule rule) {
  ByteSource source(seed);
  FilterCase made = seed % 3 == 0 ? arbitrary_case(source, cv::Size(source.between(60, 1300), 24))
                                  : arbitrary_case(source);
  draw_rule(source, made, rule);
  draw_depths(source, made);
  made.frame.depth = cv::Mat();
  return made;
}

FeatureLabels filtered(const FilterCase& input, const FeaturesView& features) {
  return DynamicFilter(input.options).apply(input.frame, input.segmentation, features);
}

TEST(FeatureDepths, DepthRuleMatchesTheOracleOnEveryPath) {
  std::size_t by_depth = 0, by_neighbours = 0, by_margin = 0, restored = 0, box_fallbacks = 0;
  std::size_t refused_boxes = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    FilterCase input = column_case(seed, CompensationRule::depth);
    if (seed % 4 == 0) forget_masked_depths(input);
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    const DepthVerdict verdict = FeatureDepthOracle(input).verdict();
    by_depth += verdict.by_depth;
    by_neighbours += verdict.by_nearness;
    by_margin += verdict.by_margin;
    restored += verdict.restored;
    box_fallbacks += verdict.box_fallbacks;
    refused_boxes += verdict.refused_boxes;
  }
  EXPECT_GT(by_depth, 800U);
  EXPECT_GT(by_neighbours, 100U);
  EXPECT_GT(by_margin, 100U);
  EXPECT_GT(restored, 300U);
  EXPECT_GT(box_fallbacks, 50U);
  EXPECT_GT(refused_boxes, 3U);
}

TEST(FeatureDepths, PaperRuleMatchesTheOracle) {
  std::size_t applied = 0, compensated = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    const FilterCase input = column_case(seed, CompensationRule::paper);
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    const FeatureLabels labels = filtered(input, input.features());
    for (const InstanceStatistics& statistics : labels.statistics().instances) {
      ASSERT_NE(statistics.compensation, Compensation::applied);
      ASSERT_EQ(statistics.passed_code, 0U);
      const bool is_applied = statistics.compensation == Compensation::applied_without_image;
      ASSERT_TRUE(is_applied || statistics.compensated == 0);
      applied += is_applied ? 1 : 0;
    }
    compensated += labels.statistics().compensated;
  }
  EXPECT_GT(applied, 300U);
  EXPECT_GT(compensated, 300U);
}

TEST(FeatureDepths, DepthImageMakesTheColumnIrrelevant) {
  for (const CompensationRule rule : {CompensationRule::depth, CompensationRule::paper}) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      ByteSource source(seed);
      FilterCase input = arbitrary_case(source);
      draw_rule(source, input, rule);
      draw_depths(source, input);
      if (input.frame.depth.empty()) continue;
      const FeatureLabels with = filtered(input, input.features());
      const FeatureLabels without = filtered(input, input.keypoints);
      for (std::size_t i = 0; i < with.size(); ++i) {
        ASSERT_TRUE(same_label(with[i], without[i])) << "seed " << seed << ", feature " << i;
      }
    }
  }
}

/// A wall at 4 m and a person at 1.5 m, with a feature every 8 pixels. The mask covers the person's
/// left half.
struct ColumnScene {
  const cv::Rect person{240, 80, 160, 320}, box{230, 70, 180, 340};
  FilterCase input;

  ColumnScene() {
    input.frame.timestamp_s = 100;
    input.segmentation.timestamp_s = 100;
    input.segmentation.image_size = {640, 480};
    Instance instance = Instance::from_box(box, 0, 0.8F);
    instance.mask_origin = person.tl();
    instance.mask = cv::Mat(320, 80, CV_8UC1, cv::Scalar(255));
    input.segmentation.instances.push_back(instance);
    for (int y = 4; y < 480; y += 8) {
      for (int x = 4; x < 640; x += 8) {
        input.keypoints.emplace_back(static_cast<float>(x), static_cast<float>(y), 31.0F);
      }
    }
  }

  FeatureLabels filtered() {
    input.depths_m.emplace();
    for (const cv::KeyPoint& keypoint : input.keypoints) {
      input.depths_m->push_back(person.contains(keypoint.pt) ? 1.5F : 4.0F);
    }
    return testing::filtered(input, input.features());
  }
};

TEST(FeatureDepths, BothRulesRemoveThePartThatTheMaskMissed) {
  for (const CompensationRule rule : {CompensationRule::depth, CompensationRule::paper}) {
    ColumnScene scene;
    scene.input.options.compensator.rule = rule;
    const FeatureLabels labels = scene.filtered();
    for (std::size_t i = 0; i < labels.size(); ++i) {
      ASSERT_EQ(labels.is_removed(i), scene.person.contains(scene.input.keypoints[i].pt)) << i;
    }
    EXPECT_EQ(labels.statistics().masked, 400U);
    EXPECT_EQ(labels.statistics().compensated, 400U);
    EXPECT_FALSE(labels.statistics().has_depth);
    EXPECT_EQ(labels.statistics().instances[0].compensation, Compensation::applied_without_image);
  }
}

TEST(FeatureDepths, StaleMaskGivesBackNothingThatAnotherStageRemoved) {
  ColumnScene scene;
  scene.input.segmentation.timestamp_s = 99.9;
  scene.filtered();                                    // fills in the depths
  const std::size_t on_wall = 100 / 8 * 80 + 212 / 8;  // a feature behind the person
  FeatureLabels labels(scene.input.keypoints.size(), scene.input.segmentation);
  labels.mark_dynamic(0);
  labels.remove(on_wall, 0, Reason::custom, 0.8F);
  FeatureDepthCompensator()({scene.input.frame, scene.input.segmentation, scene.input.features()},
                            labels);
  EXPECT_EQ(labels[on_wall].reason, Reason::custom);
}

}  // namespace
}  // namespace dynfilter::testing
