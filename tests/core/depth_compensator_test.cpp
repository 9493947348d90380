// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hand-made cases. whole_filter_test.cpp compares with the oracle, dynamic_filter_test.cpp checks
// properties.

#include "dynfilter/depth_compensator.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include "support/depth_scene.hpp"

namespace dynfilter::testing {
namespace {

TEST(DepthCompensator, RemovesTheLimbThatTheMaskMissed) {
  DepthScene scene;
  const FeatureLabel label = scene.at(390, 210);
  EXPECT_EQ(label.reason, Reason::compensated);
  EXPECT_EQ(label.instance, 0);
  EXPECT_TRUE(label.removed);
  EXPECT_EQ(label.score, 0.8F);
  const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
  EXPECT_EQ(statistics.compensation, Compensation::applied);
  EXPECT_EQ(statistics.sampled, 10U * 40U) << "every eighth pixel each way of a large mask";
  EXPECT_EQ(statistics.candidates, 1U);
  EXPECT_EQ(statistics.passed_depth, 1U);
  EXPECT_EQ(statistics.passed_nearness, 0U);
  EXPECT_EQ(statistics.compensated, 1U);
  EXPECT_NEAR(statistics.depth_range_m.lower, 1.05, 1e-6);
  EXPECT_NEAR(statistics.depth_range_m.upper, 1.95, 1e-6);
}

/// Dense maps take depth as it is: the refined mask covers the person in both images.
TEST(DepthCompensator, RefinedMaskCoversTheObjectInTheDepthImage) {
  DepthScene scene;
  scene.set_depth({0, 0, 640, 480}, 4.0);
  scene.set_depth({268, 120, 80, 320}, 1.5);
  const Instance refined =
      DepthCompensator(scene.options).refined(scene.frame, scene.segmentation, 0);
  for (int x = 268; x < 360; ++x) EXPECT_TRUE(refined.covers({x, 300})) << x;
  EXPECT_FALSE(refined.covers({262, 300}));
  EXPECT_FALSE(refined.covers({372, 300}));
}

TEST(DepthCompensator, Abstains) {
  DepthScene scene;
  const auto expect_abstains = [&](Compensation outcome, std::size_t sampled) {
    for (const double time_s : {100.0, 99.9}) {
      scene.segmentation.timestamp_s = time_s;
      EXPECT_EQ(scene.at(390, 210).reason, Reason::untouched);
      const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
      EXPECT_EQ(statistics.compensation, outcome);
      EXPECT_EQ(statistics.sampled, sampled);
      EXPECT_TRUE(statistics.depth_range_m.empty());
      EXPECT_EQ(scene.at(300, 300).removed, outcome != Compensation::not_run) << "the mask stands";
    }
  };
  scene.frame.metres_per_unit = 0.01;  // the body at 75 m, beyond all sensors
  expect_abstains(Compensation::too_few_samples, 1420);
  scene.frame.metres_per_unit = 1.0 / 5000;
  scene.set_depth({0, 0, 640, 480}, 0);
  scene.set_depth({280, 120, 24, 16}, 1.5);  // 3 x 2 readings
  expect_abstains(Compensation::too_few_samples, 6);
  scene.frame.depth = cv::Mat();
  expect_abstains(Compensation::no_depth_image, 0);
  scene.person().class_id = 56;
  expect_abstains(Compensation::not_run, 0);
}

TEST(DepthCompensator, GivesBackTheBackgroundUnderAStaleMask) {
  DepthScene scene;
  scene.make_stale();
  const FeatureLabel wall = scene.at(270, 300);
  EXPECT_EQ(wall.reason, Reason::restored);
  EXPECT_FALSE(wall.removed);
  EXPECT_EQ(wall.instance, 0);
  EXPECT_LT(wall.score, 0.4F) << "the mask has left it";
  EXPECT_EQ(scene.filtered().statistics().restored, 1U);
  EXPECT_EQ(scene.filtered().statistics().masked, 0U);
  EXPECT_EQ(scene.at(300, 300).reason, Reason::in_mask) << "it has the person's depth";
  EXPECT_EQ(scene.at(350, 300).reason, Reason::compensated) << "the mask has not reached it";
  EXPECT_EQ(scene.at(264, 300).reason, Reason::untouched) << "a stale mask has no margin";
  scene.set_depth({268, 300, 5, 5}, 0.8);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::in_mask) << "it hides the person";
  scene.set_depth({268, 300, 5, 5}, 0);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::restored) << "it is a hole in the wall";
  scene.set_depth({255, 120, 20, 320}, 3.0);  // another object, on the stale mask
  Instance second = Instance::from_box({250, 110, 40, 340}, 0, 0.6F);
  second.mask_origin = {255, 120};
  second.mask = cv::Mat(320, 8, CV_8UC1, cv::Scalar(1));
  scene.segmentation.instances.push_back(second);
  EXPECT_EQ(scene.at(270, 300).reason, Reason::in_mask);
}

TEST(DepthCompensator, GivesBackNothingThatAnotherStageRemoved) {
  DepthScene scene;
  scene.make_stale();
  scene.points = {{270, 300}};  // on the wall, under the stale mask
  FeatureLabels labels(1, scene.segmentation);
  labels.mark_dynamic(0);
  labels.remove(0, 0, Reason::custom, 0.8F);
  DepthCompensator(scene.options)({scene.frame, scene.segmentation, scene.points}, labels);
  EXPECT_EQ(labels[0].reason, Reason::custom);
}

}  // namespace
}  // namespace dynfilter::testing
