// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hand-made cases in which the masks are older than the frame.

#include "dynfilter/depth_compensator.hpp"

#include <gtest/gtest.h>

#include "support/depth_scene.hpp"

namespace dynfilter::testing {
namespace {

TEST(DepthCompensator, StaleMasksNeedLessNearness) {
  DepthScene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  scene.make_stale();
  EXPECT_TRUE(scene.compensates(366, 330)) << "3 / 7";
  EXPECT_FALSE(scene.compensates(367, 330)) << "3 / 8";
  EXPECT_NEAR(scene.at(367, 330).score, 0.8 * 0.5 * 0.375 / 0.4, 1e-6);
  scene.options.min_nearness_if_stale = 0.5;
  EXPECT_FALSE(scene.compensates(366, 330));
}

TEST(DepthCompensator, RestoresBackgroundUnderAStaleMask) {
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
  EXPECT_EQ(scene.filtered().statistics().restored, 0U);
  EXPECT_EQ(scene.at(350, 300).reason, Reason::compensated) << "the mask has not reached it";
  EXPECT_EQ(scene.at(264, 300).reason, Reason::untouched) << "a stale mask has no margin";
}

TEST(DepthCompensator, RestoresNothingThatAnotherStageRemoved) {
  DepthScene scene;
  scene.make_stale();
  scene.points = {{270, 300}};  // on the wall, under the stale mask
  FeatureLabels labels(1, scene.segmentation);
  labels.mark_dynamic(0);
  labels.remove(0, 0, Reason::custom, 0.8F);
  DepthCompensator(scene.options)({scene.frame, scene.segmentation, scene.points}, labels);
  EXPECT_EQ(labels[0].reason, Reason::custom);
}

TEST(DepthCompensator, RestoresNearerSurfacesUnderAStaleMask) {
  DepthScene scene;
  scene.make_stale();
  scene.set_depth({268, 300, 5, 5}, 0.8);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::in_mask);
  scene.set_depth({268, 300, 5, 5}, 0);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::restored) << "it is a hole in the wall";
}

TEST(DepthCompensator, AnotherObjectKeepsItsFeaturesUnderAStaleMask) {
  DepthScene scene;
  scene.make_stale();
  scene.set_depth({255, 120, 20, 320}, 3.0);  // on the stale mask from column 265 on
  Instance second = Instance::from_box({250, 110, 40, 340}, 0, 0.6F);
  second.mask_origin = {255, 120};
  second.mask = cv::Mat(320, 8, CV_8UC1, cv::Scalar(1));
  scene.segmentation.instances.push_back(second);
  EXPECT_EQ(scene.at(270, 300).reason, Reason::in_mask);
  scene.segmentation.instances.pop_back();
  EXPECT_EQ(scene.at(270, 300).reason, Reason::restored);
}

TEST(DepthCompensator, RestoresOnlyUnderMasksOfIntermediateAge) {
  DepthScene scene;
  for (const double age_s : {0.0, 0.015, -0.015, 1.1, 50.0}) {
    scene.segmentation.timestamp_s = scene.frame.timestamp_s - age_s;
    scene.person().mask_origin.x = 265;
    EXPECT_EQ(scene.at(270, 300).reason, Reason::in_mask) << age_s;
    EXPECT_TRUE(scene.compensates(264, 300)) << age_s;
  }
  for (const double age_s : {0.03, -0.03, 0.5, 0.99}) {
    scene.segmentation.timestamp_s = scene.frame.timestamp_s - age_s;
    EXPECT_EQ(scene.at(270, 300).reason, Reason::restored) << age_s;
  }
}

/// Ages of powers of two are exact.
TEST(DepthCompensator, MasksAreStaleAboveTheFirstLimitUpToTheSecond) {
  DepthScene scene;
  scene.make_stale();
  scene.options.stale_age_s = 1.0 / 32;
  scene.options.max_age_s = 0.5;
  const auto is_stale_at = [&](double age_s) {
    scene.segmentation.timestamp_s = scene.frame.timestamp_s - age_s;
    return scene.at(270, 300).reason == Reason::restored;
  };
  const double step = 1.0 / 1024;
  EXPECT_FALSE(is_stale_at(1.0 / 32)) << "masks of this age are fresh";
  EXPECT_TRUE(is_stale_at(1.0 / 32 + step));
  EXPECT_TRUE(is_stale_at(0.5)) << "masks of this age have a time";
  EXPECT_FALSE(is_stale_at(0.5 + step));
}

TEST(DepthCompensator, BoxGrowsWithMaskAge) {
  DepthScene scene;
  scene.set_depth({0, 0, 640, 480}, 1.5);  // everything in the box is the person's
  const auto expect_reach = [&](int sideways, int upwards) {
    const cv::Rect& box = scene.box;
    const auto right = static_cast<float>(box.x + box.width + sideways);
    const auto left = static_cast<float>(box.x - sideways);
    const auto top = static_cast<float>(box.y - upwards);
    const auto bottom = static_cast<float>(box.y + box.height + upwards);
    EXPECT_TRUE(scene.compensates(right - 1, 250) && !scene.compensates(right, 250)) << sideways;
    EXPECT_TRUE(scene.compensates(left, 250) && !scene.compensates(left - 1, 250)) << sideways;
    EXPECT_TRUE(scene.compensates(300, top) && !scene.compensates(300, top - 1)) << upwards;
    EXPECT_TRUE(scene.compensates(300, bottom - 1) && !scene.compensates(300, bottom)) << upwards;
  };
  scene.options.box_margin_px = 6;
  scene.options.motion_px_per_s = 400;
  expect_reach(6, 6);
  scene.segmentation.timestamp_s = 99.96875;  // 12.5 pixels
  expect_reach(19, 12);
  scene.segmentation.timestamp_s = 98;
  expect_reach(6, 6);
  scene.options.box_margin_px = 0;
  expect_reach(0, 0);
}

/// The mask holds the object's farthest depths, beyond the reach of its box.
TEST(DepthCompensator, StaleMaskKeepsTheFarEndOfTheObject) {
  DepthScene scene;
  scene.make_stale();
  scene.frame.metres_per_unit = 1.0 / 4096;  // all lengths here are exact
  scene.frame.depth.setTo(4 * 4096);
  scene.frame.depth(scene.body).setTo(6144);
  scene.options.object_depth.min_half_width_m = 0.5;
  scene.options.motion_px_per_s = 0;
  scene.person().box.x = 300;
  scene.frame.depth(cv::Rect(268, 300, 5, 5)).setTo(8192);  // 1.5 + 0.5 m
  EXPECT_EQ(scene.at(270, 302).reason, Reason::in_mask);
  scene.frame.depth(cv::Rect(268, 300, 5, 5)).setTo(8193);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::restored);
}

}  // namespace
}  // namespace dynfilter::testing
