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
/// left half. The depth of the features in `unknown` is not known.
struct ColumnScene {
  const cv::Rect person{240, 80, 160, 320}, box{230, 70, 180, 340};
  FilterCase input;
  cv::Rect unknown;

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
      const cv::Point pixel(keypoint.pt);
      input.depths_m->push_back(unknown.contains(pixel)  ? 0.0F
                                : person.contains(pixel) ? 1.5F
                                                         : 4.0F);
    }
    return testing::filtered(input, input.features());
  }

  /// Label of the feature at (x, y).
  FeatureLabel at(int x, int y) { return filtered()[static_cast<std::size_t>(y / 8 * 80 + x / 8)]; }
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

TEST(FeatureDepths, FeaturesAroundDecideWhereDepthIsUnknown) {
  ColumnScene scene;
  scene.unknown = {352, 232, 16, 16};
  EXPECT_EQ(scene.at(356, 236).reason, Reason::compensated) << "in the midst of the person";
  EXPECT_GT(scene.at(356, 236).score, 0.72F) << "the share times the confidence";
  EXPECT_LT(scene.at(356, 236).score, 0.8F);
  scene.unknown = {400, 232, 8, 8};
  EXPECT_FALSE(scene.at(404, 236).removed) << "beside the person";
  EXPECT_GT(scene.at(404, 236).score, 0.1F) << "but suspect";
  EXPECT_LT(scene.at(404, 236).score, 0.4F);
}

TEST(FeatureDepths, StaleMaskGivesBackWhatIsBehindThePerson) {
  ColumnScene scene;
  scene.input.segmentation.timestamp_s = 99.9;
  scene.input.segmentation.instances[0].mask_origin.x = 200;  // 40 px left of the person
  EXPECT_EQ(scene.at(212, 236).reason, Reason::restored) << "by its depth";
  EXPECT_EQ(scene.at(252, 236).reason, Reason::in_mask);
  EXPECT_EQ(scene.at(380, 236).reason, Reason::compensated);
  scene.unknown = {208, 232, 8, 8};
  EXPECT_EQ(scene.at(212, 236).reason, Reason::restored) << "as the features around";
  scene.unknown = {248, 232, 8, 8};
  EXPECT_EQ(scene.at(252, 236).reason, Reason::in_mask);
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

TEST(FeatureDepths, BoxTellsNothingWhereAMaskOfManyFeaturesHasNoDepth) {
  ColumnScene scene;
  scene.unknown = scene.person;  // as where it lies outside the right image of a pair
  Instance& instance = scene.input.segmentation.instances[0];
  instance.box = {120, 70, 200, 340};  // the wall is in its middle
  EXPECT_FALSE(scene.at(204, 236).removed) << "the wall is not the person's";
  EXPECT_EQ(scene.filtered().statistics().compensated, 0U);
  EXPECT_EQ(scene.filtered().statistics().instances[0].compensation, Compensation::too_few_samples);
  instance.mask = cv::Mat(24, 64, CV_8UC1, cv::Scalar(255));  // 24 features
  EXPECT_FALSE(scene.at(204, 236).removed);
  instance.mask.at<std::uint8_t>(4, 4) = 0;
  EXPECT_TRUE(scene.at(204, 236).removed) << "23 may lack depth by chance";
  instance.mask.at<std::uint8_t>(4, 4) = 255;
  scene.unknown = {248, 80, 152, 320};  // the first feature on the mask has depth
  EXPECT_TRUE(scene.at(204, 236).removed);
}

}  // namespace
}  // namespace dynfilter::testing
