// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/mask_culler.hpp"

#include <gtest/gtest.h>

#include "dynfilter/detection_mask.hpp"
#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

FeatureLabels culled(const FilterCase& input) {
  FeatureLabels labels(input.keypoints.size(), input.segmentation);
  MaskCuller(input.options.mask_culler)({input.frame, input.segmentation, input.keypoints}, labels);
  return labels;
}

TEST(MaskCuller, MatchesTheOracleOnArbitraryInput) {
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    const FeatureLabels labels = culled(input);
    const std::vector<FeatureLabel> expected = oracle_cull(input);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_TRUE(same_label(labels[i], expected[i]))
          << "seed " << seed << ", feature " << i << ": got " << describe(labels[i]) << "; want "
          << describe(expected[i]);
    }
  }
}

TEST(MaskCuller, StaticMaskActsInEveryFrameWithoutAnInstance) {
  FilterCase input;
  input.frame.image = cv::Mat::zeros(4, 4, CV_8UC1);
  cv::Mat robot = cv::Mat::zeros(4, 4, CV_8UC1);
  robot.row(3).setTo(1);
  input.options.mask_culler.static_mask = robot;
  input.keypoints = {{1, 3, 1}, {1, 2, 1}};
  const MaskCuller culler(input.options.mask_culler);
  robot.setTo(255);  // the culler has copied the option
  FeatureLabels labels(2, input.segmentation);
  culler({input.frame, input.segmentation, input.keypoints}, labels);
  EXPECT_TRUE(labels.is_removed(0));
  EXPECT_EQ(labels[0].instance, -1);
  EXPECT_EQ(labels[0].score, 1.0F);
  EXPECT_FALSE(labels.is_removed(1));
  EXPECT_EQ(labels.statistics().masked, 1U);
}

TEST(MaskCuller, TwoCullersInAPipelineAddUp) {
  FilterCase input;
  input.segmentation.image_size = {20, 20};
  for (const int class_id : {0, 2}) {
    input.segmentation.instances.push_back(Instance::from_box_mask(
        cv::Mat(5, 5, CV_8UC1, cv::Scalar(1)), {3, 3 + 5 * class_id, 5, 5}, class_id));
  }
  MaskCullerOptions cars;
  cars.dynamic_classes = {2};
  const FeatureLabels labels = Pipeline(MaskCuller(), MaskCuller(cars))
                                   .apply(input.frame, input.segmentation, input.keypoints);
  EXPECT_TRUE(labels.statistics().instances[0].dynamic);
  EXPECT_TRUE(labels.statistics().instances[1].dynamic);
}

TEST(DetectionMask, MatchesTheCuller) {
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    const FeatureLabels labels = culled(input);
    const DetectionMask mask(input.segmentation, MaskCuller(input.options.mask_culler));
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::KeyPoint& keypoint = input.keypoints[i];
      ASSERT_EQ(mask.allows(keypoint.pt), !labels.is_removed(i)) << "seed " << seed;
    }
  }
}

TEST(DetectionMask, IsExactToThePixelOnHigherPyramidLevels) {
  const cv::Rect box(100, 80, 60, 120);
  Segmentation segmentation;
  segmentation.image_size = {640, 480};
  segmentation.instances.push_back(
      Instance::from_box_mask(cv::Mat(120, 60, CV_8UC1, cv::Scalar(255)), box));
  const DetectionMask mask(segmentation);
  const double scale = 1.2 * 1.2 * 1.2;
  for (int y = 0; y < 277; ++y) {
    for (int x = 0; x < 370; ++x) {
      const cv::Point2f level_0(static_cast<float>(x * scale), static_cast<float>(y * scale));
      ASSERT_EQ(mask.allows(level_0), !box.contains(nearest_pixel(level_0)));
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
