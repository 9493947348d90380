// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/edge_compensator.hpp"

#include <gtest/gtest.h>

#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

/// A wall at 3 m and a person at 1.5 m in the box (20,10) 30x40, whose mask misses the lower half.
/// Depth has a slope, so that inner pixels of the person have more than one code.
struct Scene {
  FilterCase input;

  Scene() {
    cv::Mat depth(60, 80, CV_16UC1, cv::Scalar(15000));
    for (int y = 10; y < 50; ++y) {
      for (int x = 20; x < 50; ++x) {
        depth.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(7500 + (x * 7 + y * 3) % 11);
      }
    }
    input.options.compensator.rule = CompensationRule::paper;
    input.frame.depth = depth;
    input.frame.metres_per_unit = 1.0 / 5000;
    input.segmentation.image_size = depth.size();
    Instance person = Instance::from_box({15, 5, 40, 50}, 0, 0.9F);
    person.mask_origin = {20, 10};
    person.mask = cv::Mat(20, 30, CV_8UC1, cv::Scalar(255));
    input.segmentation.instances.push_back(person);
    for (int y = 1; y < 59; y += 3) {
      for (int x = 1; x < 79; x += 3) {
        input.keypoints.emplace_back(static_cast<float>(x), static_cast<float>(y), 31.0F);
      }
    }
  }

  FeatureLabels filtered() const {
    return DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
  }
};

TEST(EdgeCompensator, RemovesThePartThatTheMaskMissed) {
  const Scene scene;
  const FeatureLabels labels = scene.filtered();
  const InstanceStatistics& person = labels.statistics().instances[0];
  EXPECT_EQ(person.compensation, Compensation::applied);
  EXPECT_EQ(person.sampled, 20U);
  EXPECT_NEAR(person.depth_range_m.lower, 1.4, 0.003);
  EXPECT_NEAR(person.depth_range_m.upper, 1.6, 0.003);
  std::size_t on_person = 0, found = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const cv::Point pixel = FeaturesView(scene.input.keypoints).pixel(i);
    const bool missed = cv::Rect(20, 30, 30, 20).contains(pixel);
    on_person += missed;
    found += missed && labels[i].reason == Reason::compensated;
    if (!cv::Rect(20, 10, 30, 40).contains(pixel)) {
      EXPECT_FALSE(labels.is_removed(i)) << "static at " << pixel;
    }
  }
  ASSERT_GT(on_person, 50U);
  EXPECT_EQ(found, person.compensated);
  EXPECT_GE(found * 10, on_person * 9) << "the codes of 20 samples cover nearly all of it";
}

TEST(EdgeCompensator, AbstainsWithoutDepth) {
  Scene scene;
  scene.input.frame.depth = cv::Mat();
  const FrameStatistics statistics = scene.filtered().statistics();
  EXPECT_EQ(statistics.instances[0].compensation, Compensation::no_depth_image);
  EXPECT_GT(statistics.masked, 0U) << "without depth the mask culler still works";
  EXPECT_EQ(statistics.compensated, 0U);
}

TEST(EdgeCompensator, WorksAfterAUserDefinedMaskStage) {
  Scene scene;
  scene.input.segmentation.instances[0].class_id = 56;  // dynamic in the caller's opinion
  const auto own_masks = [](const FilterInput& input, FeatureLabels& labels) {
    for (std::size_t i = 0; i < input.features.size(); ++i) {
      if (!input.segmentation.instances[0].covers(input.features.pixel(i))) continue;
      labels.remove(i, 0, Reason::in_mask, 1.0F);
    }
  };
  const FeatureLabels labels =
      Pipeline(own_masks, EdgeCompensator())
          .apply(scene.input.frame, scene.input.segmentation, scene.input.keypoints);
  EXPECT_EQ(labels.statistics().instances[0].compensation, Compensation::applied);
  EXPECT_GT(labels.statistics().compensated, 20U);
}

TEST(EdgeCompensator, DefaultOptionsArePinned) {
  const EdgeCompensatorOptions paper = EdgeCompensatorOptions::paper();
  EXPECT_EQ(paper.samples, 20U);
  for (const RangeEstimatorOptions& range : {paper.depth, paper.code}) {
    EXPECT_EQ(range.outlier_rule, OutlierRule::median_absolute_deviation);
    EXPECT_EQ(range.outlier_factor, 3.0);
  }
  EXPECT_EQ(paper.depth.expansion, 0.10);
  EXPECT_EQ(paper.code.expansion, 16.0);
  EXPECT_EQ(paper.missing_depth, MissingDepth::keep);
  EXPECT_EQ(RangeEstimator::min_samples, 5U);
}

/// A second compensator in the same pipeline counts afresh.
TEST(EdgeCompensator, ResetsItsCounters) {
  const Scene scene;
  const FilterCase& input = scene.input;
  const auto statistics = [&](const auto& pipeline) {
    return pipeline.apply(input.frame, input.segmentation, input.keypoints).statistics();
  };
  const InstanceStatistics once =
      statistics(Pipeline(MaskCuller(), EdgeCompensator())).instances[0];
  const InstanceStatistics twice =
      statistics(Pipeline(MaskCuller(), EdgeCompensator(), EdgeCompensator())).instances[0];
  EXPECT_EQ(twice.candidates, once.candidates - once.compensated);
  EXPECT_EQ(twice.passed_depth, once.passed_depth - once.compensated);
  EXPECT_EQ(twice.passed_code, once.passed_code - once.compensated);
}

TEST(EdgeCompensator, ReportedRangesMatchTheOracle) {
  std::size_t ranges = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    if (input.frame.depth.empty()) continue;
    const FeatureLabels labels =
        DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
    const std::vector<FeatureLabel> culled = oracle_cull(input);
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      const auto [depth, code] = oracle_ranges(input, culled, k);
      const InstanceStatistics& statistics = labels.statistics().instances[k];
      ASSERT_EQ(statistics.depth_range_m.lower, depth.lower) << "seed " << seed;
      ASSERT_EQ(statistics.depth_range_m.upper, depth.upper) << "seed " << seed;
      ASSERT_EQ(statistics.code_range.lower, code.lower) << "seed " << seed;
      ASSERT_EQ(statistics.code_range.upper, code.upper) << "seed " << seed;
      ranges += depth.empty() ? 0 : 1;
    }
  }
  EXPECT_GT(ranges, 200U);
}

}  // namespace
}  // namespace dynfilter::testing
