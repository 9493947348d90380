// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/pipeline.hpp"

#include "dynfilter/dynfilter.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

TEST(Pipeline, RunsStagesInOrderAndTheFirstWins) {
  const auto first = [](const FilterInput&, FeatureLabels& labels) {
    labels.remove(0, -1, Reason::custom, 0.25F);
  };
  const auto second = [](const FilterInput&, FeatureLabels& labels) {
    EXPECT_TRUE(labels.is_removed(0));
    labels.remove(0, -1, Reason::in_mask, 1.0F);
    labels.remove(1, -1, Reason::in_mask, 1.0F);
  };
  const std::vector<cv::Point2f> points(2);
  const FeatureLabels labels = Pipeline(first, second).apply(FrameView(), Segmentation(), points);
  EXPECT_EQ(labels[0].reason, Reason::custom);
  EXPECT_EQ(labels[1].reason, Reason::in_mask);
}

TEST(Pipeline, DistinguishesNoSegmentationFromAnEmptyOne) {
  const DynamicFilter filter;
  FrameView frame;
  frame.timestamp_s = 3.0;
  Segmentation nobody;
  nobody.timestamp_s = 2.75;
  const FrameStatistics of_nobody = filter.apply(frame, nobody, FeaturesView()).statistics();
  EXPECT_TRUE(of_nobody.has_segmentation);
  EXPECT_EQ(of_nobody.segmentation_age_s, 0.25);
  EXPECT_TRUE(std::isnan(filter.apply(frame, Segmentation(), {}).statistics().segmentation_age_s));
  const std::vector<cv::KeyPoint> keypoints;
  const std::optional<Segmentation> maybe;
  for (const FeatureLabels& labels :
       {filter.apply(frame, std::nullopt, keypoints), filter.apply(frame, maybe, keypoints),
        filter.apply(frame, {}, keypoints)}) {
    EXPECT_FALSE(labels.statistics().has_segmentation);
    EXPECT_TRUE(std::isnan(labels.statistics().segmentation_age_s)) << "no masks have no age";
  }
  EXPECT_TRUE(filter.apply(frame, std::optional(nobody), {}).statistics().has_segmentation);
  FeatureLabels labels;
  Workspace workspace;
  filter.apply(frame, {}, keypoints, labels, workspace);
  EXPECT_FALSE(labels.statistics().has_segmentation);
  filter.apply(frame, nobody, keypoints, labels, workspace);
  EXPECT_TRUE(labels.statistics().has_segmentation);
}

TEST(Pipeline, LeavesNoLabelsIfAStageThrows) {
  const auto removes = [](const FilterInput&, FeatureLabels& labels) {
    labels.remove(0, -1, Reason::custom, 1.0F);
  };
  const auto throws = [](const FilterInput&, FeatureLabels&) { throw std::runtime_error("no"); };
  Segmentation segmentation;
  segmentation.image_size = {20, 10};
  segmentation.instances.push_back(Instance::from_box({0, 0, 5, 5}));
  FeatureLabels labels;
  Workspace workspace;
  const std::vector<cv::Point2f> points(2);
  EXPECT_THROW(
      Pipeline(removes, throws).apply(FrameView(), segmentation, points, labels, workspace),
      std::runtime_error);
  EXPECT_TRUE(labels.empty());
  EXPECT_EQ(labels.statistics().features, 0U);
  EXPECT_EQ(labels.statistics().custom, 0U);
  EXPECT_TRUE(labels.statistics().instances.empty());
}

TEST(Pipeline, ValidatesInputThatAStageReplaces) {
  Segmentation malformed;
  malformed.image_size = {2, 1};
  malformed.instances = {Instance::from_box({0, 0, -1, 1})};
  const auto with_other_masks = [&](const FilterInput& input, FeatureLabels& labels) {
    labels.reset(input.features.size(), malformed);
    MaskCuller()({input.frame, malformed, input.features}, labels);
  };
  const std::vector<cv::Point2f> points(2);
  const auto apply = [&] { Pipeline(with_other_masks).apply(FrameView(), Segmentation(), points); };
  expect_misuse(apply, "a box of -1x1 in instance 0");
}

TEST(Pipeline, RefusesMasksOfAnotherImageSize) {
  const cv::Mat mask(10, 20, CV_8UC1, cv::Scalar(255));
  const std::vector<cv::Point2f> points(2);
  for (const Instance& instance :
       {Instance::from_image_mask(mask), Instance::from_image_mask(mask, {0, 0, 5, 5}),
        Instance::from_static_mask(mask), instances_from_label_map(mask / 255)[0],
        instances_from_binary_mask(mask)[0]}) {
    Segmentation people;
    people.instances = {instance};
    people.image_size = {20, 10};
    EXPECT_NO_THROW(Pipeline(MaskCuller()).apply(FrameView(), people, points));
    people.image_size = {40, 20};
    expect_misuse([&] { Pipeline(MaskCuller()).apply(FrameView(), people, points); },
                  "a mask of a 20x10 image in instance 0");
  }
}

TEST(Pipeline, ValidatesLabelsThatTheLastStageReplaces) {
  const auto with_one_label = [](const FilterInput& input, FeatureLabels& labels) {
    labels.reset(1, input.segmentation);
  };
  const std::vector<cv::Point2f> points(2);
  FeatureLabels labels;
  Workspace workspace;
  expect_misuse(
      [&] {
        Pipeline(with_one_label).apply(FrameView(), Segmentation(), points, labels, workspace);
      },
      "Pipeline");
  EXPECT_TRUE(labels.empty());
}

/// Segmentation with a mask on the left half of the image.
Segmentation left_half_masked() {
  Segmentation segmentation;
  segmentation.image_size = {100, 10};
  segmentation.instances = {
      Instance::from_box_mask(cv::Mat(10, 50, CV_8UC1, cv::Scalar(1)), {0, 0, 50, 10})};
  return segmentation;
}

/// Neither the stage nor later ones may see what the inner pipeline wrote into the workspace.
TEST(Pipeline, NestedPipelineMayUseTheSameWorkspace) {
  const std::vector<cv::Point2f> points = {{10, 5}, {90, 5}, {20, 5}},
                                 mirrored = {{90, 5}, {10, 5}, {80, 5}};
  const auto other_features = [&](const FilterInput& input, FeatureLabels&, Workspace& workspace) {
    FeatureLabels labels;
    Pipeline(MaskCuller()).apply(input.frame, input.segmentation, mirrored, labels, workspace);
    EXPECT_TRUE(labels.is_removed(1));
    EXPECT_EQ(input.index.pixel(0), cv::Point(10, 5));
    EXPECT_EQ(*input.index.inside(cv::Rect(80, 0, 20, 10)).begin(), 1U);
    MaskCuller()({input.frame, input.segmentation, mirrored, &workspace}, labels);
  };
  const FeatureLabels labels =
      Pipeline(other_features, MaskCuller()).apply(FrameView(), left_half_masked(), points);
  EXPECT_TRUE(labels.is_removed(0));
  EXPECT_FALSE(labels.is_removed(1));
  EXPECT_TRUE(labels.is_removed(2));
}

}  // namespace
}  // namespace dynfilter::testing
