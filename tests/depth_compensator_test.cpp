// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hand-made cases. whole_filter_test.cpp compares with the oracle, dynamic_filter_test.cpp checks
// properties.

#include "dynfilter/depth_compensator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/mask_culler.hpp"
#include "dynfilter/pipeline.hpp"

namespace dynfilter::testing {
namespace {

/// A wall at 4 m and a flat person at 1.5 m in 640x480: the body, whose mask is exact, and a limb
/// to its right, which the mask misses. Masks and frame have the same time.
struct Scene {
  const cv::Rect body{280, 120, 80, 320}, limb{360, 200, 40, 20}, box{260, 110, 160, 340};
  FrameView frame;
  Segmentation segmentation;
  DepthCompensatorOptions options;
  MaskCullerOptions culler;
  std::vector<cv::Point2f> points;

  Scene() {
    frame.timestamp_s = 100;
    frame.depth = cv::Mat(480, 640, CV_16UC1);
    frame.metres_per_unit = 1.0 / 5000;
    set_depth({0, 0, 640, 480}, 4.0);
    set_depth(body, 1.5);
    set_depth(limb, 1.5);
    segmentation.timestamp_s = 100;
    segmentation.image_size = {640, 480};
    Instance person = Instance::from_box(box, 0, 0.8F);
    person.mask_origin = body.tl();
    person.mask = cv::Mat(body.size(), CV_8UC1, cv::Scalar(255));
    segmentation.instances.push_back(person);
  }

  Instance& person() { return segmentation.instances[0]; }

  void set_depth(const cv::Rect& area, double depth_m) {
    frame.depth(area).setTo(cv::Scalar(std::round(depth_m * 5000)));
  }

  /// Makes the mask 0.1 s old and places it to the left of the body: columns 265 to 344.
  void make_stale() {
    person().mask_origin.x = 265;
    segmentation.timestamp_s = frame.timestamp_s - 0.1;
  }

  FeatureLabels filtered() const {
    return Pipeline(MaskCuller(culler), DepthCompensator(options))
        .apply(frame, segmentation, points);
  }

  /// Label of a single feature there.
  FeatureLabel at(float x, float y) {
    points = {{x, y}};
    return filtered()[0];
  }

  bool takes(float x, float y) { return at(x, y).reason == Reason::compensated; }
};

TEST(DepthCompensator, RemovesTheLimbThatTheMaskMissed) {
  Scene scene;
  const FeatureLabel label = scene.at(390, 210);
  EXPECT_EQ(label.reason, Reason::compensated);
  EXPECT_EQ(label.instance, 0);
  EXPECT_TRUE(label.removed);
  EXPECT_EQ(label.score, 0.8F);
  const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
  EXPECT_EQ(statistics.compensation, Compensation::applied);
  EXPECT_EQ(statistics.sampled, 20U * 80U);
  EXPECT_EQ(statistics.candidates, 1U);
  EXPECT_EQ(statistics.passed_depth, 1U);
  EXPECT_EQ(statistics.passed_nearness, 0U);
  EXPECT_EQ(statistics.compensated, 1U);
  EXPECT_NEAR(statistics.depth_range_m.lower, 1.1, 1e-6);
  EXPECT_NEAR(statistics.depth_range_m.upper, 1.9, 1e-6);
}

TEST(DepthCompensator, KeepsTheWallUpToTheEdge) {
  Scene scene;
  for (const auto& [x, y] : {std::pair(400.0F, 400.0F),
                             {401.0F, 210.0F},
                             {362.0F, 300.0F},
                             {278.0F, 300.0F},
                             {300.0F, 118.0F}}) {
    EXPECT_EQ(scene.at(x, y).reason, Reason::untouched) << x << ", " << y;
  }
  EXPECT_EQ(scene.filtered().statistics().instances[0].candidates, 1U);
}

TEST(DepthCompensator, RemovesFeaturesOnePixelFromAFreshMask) {
  Scene scene;
  scene.person().mask_origin.x = 265;  // on the wall, so that its depth is not the object's
  EXPECT_TRUE(scene.takes(264, 300));
  EXPECT_EQ(scene.at(264, 300).score, 0.8F);
  EXPECT_FALSE(scene.takes(263, 300));
  EXPECT_FALSE(scene.takes(264, 440)) << "1.4 pixels from the corner";
  scene.options.mask_margin_px = 1.5;
  EXPECT_TRUE(scene.takes(264, 440));
  scene.options.mask_margin_px = 0;
  EXPECT_FALSE(scene.takes(264, 300));
}

TEST(DepthCompensator, ObjectReachesFortyCentimetresEachWay) {
  Scene scene;
  const cv::Rect patch(380, 300, 5, 5);  // 20 pixels from the body: no nearness
  for (const auto& [depth_m, taken] :
       {std::pair(1.89, true), {1.91, false}, {1.11, true}, {1.09, false}}) {
    scene.set_depth(patch, depth_m);
    EXPECT_EQ(scene.takes(382, 302), taken) << depth_m;
  }
}

TEST(DepthCompensator, RemovesFeaturesInHolesNearTheObject) {
  Scene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  // The body's edge, 359, is 4 pixels to the left in three directions: 3 / 4.
  EXPECT_TRUE(scene.takes(363, 330));
  EXPECT_NEAR(scene.at(363, 330).score, 0.8 * (0.5 + 0.75 / 8), 1e-6);
  EXPECT_TRUE(scene.takes(365, 330)) << "3 / 6 is just enough";
  EXPECT_FALSE(scene.takes(366, 330)) << "3 / 7 is not";
  EXPECT_FALSE(scene.takes(380, 330));
  const InstanceStatistics statistics = [&] {
    scene.points = {{363, 330}, {366, 330}};
    return scene.filtered().statistics().instances[0];
  }();
  EXPECT_EQ(statistics.candidates, 2U);
  EXPECT_EQ(statistics.passed_depth, 0U);
  EXPECT_EQ(statistics.passed_nearness, 1U);
}

TEST(DepthCompensator, KeptFeaturesHaveScoresBelowHalfTheConfidence) {
  Scene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  const FeatureLabel suspect = scene.at(366, 330);  // nearness 3 / 7; the minimum is 1 / 2
  EXPECT_EQ(suspect.reason, Reason::untouched);
  EXPECT_EQ(suspect.instance, 0);
  EXPECT_NEAR(suspect.score, 0.8 * 0.5 * 6 / 7, 1e-6);
  const FeatureLabel far_off = scene.at(380, 330);
  EXPECT_EQ(far_off.instance, -1);
  EXPECT_EQ(far_off.score, 0);
}

TEST(DepthCompensator, StaleMasksNeedLessNearness) {
  Scene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  scene.make_stale();
  EXPECT_TRUE(scene.takes(366, 330)) << "3 / 7";
  EXPECT_FALSE(scene.takes(367, 330)) << "3 / 8";
  EXPECT_NEAR(scene.at(367, 330).score, 0.8 * 0.5 * 0.375 / 0.4, 1e-6);
  scene.options.min_nearness_if_stale = 0.5;
  EXPECT_FALSE(scene.takes(366, 330));
}

TEST(DepthCompensator, WorksWithABoxAlone) {
  Scene scene;
  scene.segmentation.instances = {Instance::from_box(scene.box, 0, 0.8F)};
  EXPECT_TRUE(scene.takes(390, 210));
  EXPECT_TRUE(scene.takes(300, 300));
  EXPECT_FALSE(scene.takes(400, 400));
  const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
  EXPECT_EQ(statistics.compensation, Compensation::applied);
  EXPECT_NEAR(statistics.depth_range_m.lower, 1.1, 1e-6);
}

TEST(DepthCompensator, HoleInsideTheObjectRaisesTheScore) {
  Scene scene;
  scene.person().mask.rowRange(160, 320).setTo(0);
  scene.set_depth({318, 398, 5, 5}, 0);
  EXPECT_NEAR(scene.at(320, 400).score, 0.8 * (0.5 + 8.0 / 3 / 8), 1e-6);
  scene.set_depth({318, 398, 5, 5}, 1.5);
  scene.set_depth({320, 400, 1, 1}, 4);  // the background's depth, as at edges of thin limbs
  EXPECT_NEAR(scene.at(320, 400).score, 0.8, 1e-6) << "the score is at most the confidence";
}

TEST(DepthCompensator, KeepsFeaturesNearerThanTheObject) {
  Scene scene;
  scene.set_depth({378, 208, 5, 5}, 1.0);
  EXPECT_EQ(scene.at(380, 210).reason, Reason::untouched);
  scene.set_depth({378, 208, 5, 5}, 0);
  EXPECT_TRUE(scene.takes(380, 210)) << "the limb surrounds it";
}

/// An object closer to the lens than its minimum width must not remove all features without depth.
TEST(DepthCompensator, HandBeforeTheLensDoesNotRemoveDistantHoles) {
  Scene scene;
  scene.set_depth(scene.body, 0.3);
  scene.set_depth({380, 300, 40, 60}, 0);
  EXPECT_EQ(scene.at(400, 330).reason, Reason::untouched);
  EXPECT_TRUE(scene.takes(360, 290)) << "the mask's margin";
}

TEST(DepthCompensator, AbstainsIfTheObjectIsBeyondTheSensorRange) {
  Scene scene;
  scene.frame.metres_per_unit = 0.01;  // the body at 75 m
  scene.set_depth({360, 300, 40, 60}, 0);
  EXPECT_EQ(scene.at(380, 330).reason, Reason::untouched);
  EXPECT_EQ(scene.filtered().statistics().instances[0].compensation, Compensation::too_few_samples);
}

TEST(DepthCompensator, EmptyMaskFallsBackToTheBox) {
  Scene scene;
  scene.person().mask = cv::Mat();
  EXPECT_TRUE(scene.takes(390, 210));
  EXPECT_TRUE(scene.takes(300, 300));
  EXPECT_FALSE(scene.takes(400, 400));
}

TEST(DepthCompensator, MaskOfOneLimbFallsBackToTheBox) {
  Scene scene;
  scene.set_depth(scene.limb, 0.9);
  scene.person().mask_origin = scene.limb.tl();
  scene.person().mask = cv::Mat(scene.limb.size(), CV_8UC1, cv::Scalar(1));
  EXPECT_EQ(scene.at(390, 210).reason, Reason::in_mask);
  scene.options.object_depth.min_mask_share = 0.01;
  EXPECT_FALSE(scene.takes(300, 300));
  scene.options.object_depth.min_mask_share = 0.02;
  EXPECT_TRUE(scene.takes(300, 300));
  EXPECT_FALSE(scene.takes(400, 400));
}

/// Two persons in one detection, each with some relief; features beside their common mask.
TEST(DepthCompensator, RemovesTwoTouchingPersonsInOneDetection) {
  for (const double second_m : {1.9, 3.0}) {
    Scene scene;
    for (int x = 280; x < 400; ++x) {
      const double relief_m = 0.1 * ((x - 280) % 40) / 40;
      scene.set_depth({x, 120, 1, 320}, (x < 340 ? 1.5 : second_m) + relief_m);
    }
    scene.person().mask = cv::Mat(320, 110, CV_8UC1, cv::Scalar(255));  // columns up to 390
    EXPECT_EQ(scene.takes(395, 300), second_m == 1.9) << second_m;
    EXPECT_EQ(scene.at(300, 300).reason, Reason::in_mask);
  }
}

TEST(DepthCompensator, RestoresBackgroundUnderAStaleMask) {
  Scene scene;
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

TEST(DepthCompensator, RestoresNearerSurfacesUnderAStaleMask) {
  Scene scene;
  scene.make_stale();
  scene.set_depth({268, 300, 5, 5}, 0.8);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::in_mask);
  scene.set_depth({268, 300, 5, 5}, 0);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::restored) << "it is a hole in the wall";
}

TEST(DepthCompensator, AnotherObjectKeepsItsFeaturesUnderAStaleMask) {
  Scene scene;
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
  Scene scene;
  for (const double age_s : {0.0, 0.015, -0.015, 1.1, 50.0}) {
    scene.segmentation.timestamp_s = scene.frame.timestamp_s - age_s;
    scene.person().mask_origin.x = 265;
    EXPECT_EQ(scene.at(270, 300).reason, Reason::in_mask) << age_s;
    EXPECT_TRUE(scene.takes(264, 300)) << age_s;
  }
  for (const double age_s : {0.03, -0.03, 0.5, 0.99}) {
    scene.segmentation.timestamp_s = scene.frame.timestamp_s - age_s;
    EXPECT_EQ(scene.at(270, 300).reason, Reason::restored) << age_s;
  }
}

TEST(DepthCompensator, BoxGrowsWithMaskAge) {
  Scene scene;
  scene.set_depth({0, 0, 640, 480}, 1.5);  // everything in the box is the person's
  const auto expect_reach = [&](int sideways, int upwards) {
    const cv::Rect& box = scene.box;
    const auto right = static_cast<float>(box.x + box.width + sideways);
    const auto left = static_cast<float>(box.x - sideways);
    const auto top = static_cast<float>(box.y - upwards);
    const auto bottom = static_cast<float>(box.y + box.height + upwards);
    EXPECT_TRUE(scene.takes(right - 1, 250) && !scene.takes(right, 250)) << sideways;
    EXPECT_TRUE(scene.takes(left, 250) && !scene.takes(left - 1, 250)) << sideways;
    EXPECT_TRUE(scene.takes(300, top) && !scene.takes(300, top - 1)) << upwards;
    EXPECT_TRUE(scene.takes(300, bottom - 1) && !scene.takes(300, bottom)) << upwards;
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

TEST(DepthCompensator, AbstainsWithoutDepth) {
  Scene scene;
  scene.frame.depth = cv::Mat();
  scene.points = {{390, 210}, {300, 300}, {360, 300}};
  for (const double time_s : {100.0, 99.9}) {
    scene.segmentation.timestamp_s = time_s;
    const FeatureLabels labels = scene.filtered();
    EXPECT_EQ(labels[0].reason, Reason::untouched);
    EXPECT_EQ(labels[1].reason, Reason::in_mask);
    EXPECT_EQ(labels[2].reason, Reason::untouched) << "even in the margin";
    EXPECT_EQ(labels.statistics().instances[0].compensation, Compensation::no_depth_image);
    EXPECT_EQ(labels.statistics().instances[0].sampled, 0U);
  }
}

TEST(DepthCompensator, AbstainsWithTooFewDepths) {
  Scene scene;
  scene.set_depth({0, 0, 640, 480}, 0);
  scene.set_depth({280, 120, 12, 8}, 1.5);  // 3 x 2 readings
  scene.segmentation.timestamp_s = 99.9;
  EXPECT_EQ(scene.at(290, 121).reason, Reason::in_mask);
  EXPECT_EQ(scene.at(390, 210).reason, Reason::untouched);
  const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
  EXPECT_EQ(statistics.compensation, Compensation::too_few_samples);
  EXPECT_EQ(statistics.sampled, 6U);
  EXPECT_TRUE(statistics.depth_range_m.empty());
}

TEST(DepthCompensator, IgnoresOtherClasses) {
  Scene scene;
  scene.person().class_id = 56;
  EXPECT_EQ(scene.at(390, 210).reason, Reason::untouched);
  const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
  EXPECT_EQ(statistics.compensation, Compensation::not_run);
  EXPECT_EQ(statistics.candidates, 0U);
}

TEST(DepthCompensator, FeatureGoesToTheFirstInstanceThatAcceptsIt) {
  Scene scene;
  Instance first = scene.person();  // the same box, another depth
  scene.set_depth({420, 400, 20, 40}, 2.5);
  first.mask_origin = {420, 400};
  first.mask = cv::Mat(40, 20, CV_8UC1, cv::Scalar(1));
  first.box.width += 40;
  scene.options.object_depth.min_mask_share = 0;
  scene.segmentation.instances = {first, scene.person(), scene.person()};
  EXPECT_EQ(scene.at(390, 210).instance, 1);
  const FrameStatistics statistics = scene.filtered().statistics();
  EXPECT_EQ(statistics.instances[0].candidates, 1U);
  EXPECT_EQ(statistics.instances[0].compensated, 0U);
  EXPECT_EQ(statistics.instances[1].compensated, 1U);
  EXPECT_EQ(statistics.instances[2].candidates, 0U);
}

TEST(DepthCompensator, AcceptsPositionsOutsideTheImage) {
  Scene scene;
  constexpr float infinite = std::numeric_limits<float>::infinity();
  scene.person().box = {-1000, -1000, 5000, 5000};
  scene.points = {{-1, 300},       {640, 300},        {300, -1},
                  {300, 480},      {1e30F, 300},      {std::nanf(""), 300},
                  {300, infinite}, {-infinite, 2e9F}, {-0.6F, -0.6F},
                  {390, 210}};
  for (const double time_s : {100.0, 99.9}) {
    scene.segmentation.timestamp_s = time_s;
    const FeatureLabels labels = scene.filtered();
    EXPECT_EQ(labels.statistics().removed(), 1U);
    EXPECT_TRUE(labels.is_removed(9));
    EXPECT_EQ(labels.statistics().instances[0].candidates, 1U);
  }
}

/// The mask holds the object's farthest depths, beyond the reach of its box.
TEST(DepthCompensator, StaleMaskKeepsTheFarEndOfTheObject) {
  Scene scene;
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

/// Doubles width and height: each pixel becomes four. Features are at the upper left one, so only
/// distances to the right and downwards double exactly.
TEST(DepthCompensator, LabelsDoNotDependOnImageScale) {
  Scene scene;
  scene.set_depth({262, 300, 18, 60}, 0);  // a hole to the left of the body
  for (int y = 101; y < 460; y += 3) {
    const bool nearly_in_hole = (y > 290 && y < 313) || (y > 347 && y < 370);
    for (int x = 250; x < 279 && !nearly_in_hole; x += 2) scene.points.emplace_back(x, y);
    for (int x = 362; x < 430; x += 4) scene.points.emplace_back(x, y);
  }
  Scene twice = scene;
  cv::resize(scene.frame.depth, twice.frame.depth, {}, 2, 2, cv::INTER_NEAREST);
  twice.segmentation.image_size = {1280, 960};
  const cv::Rect& box = scene.box;
  twice.person().box = {2 * box.x, 2 * box.y, 2 * box.width, 2 * box.height};
  twice.person().mask_origin *= 2;
  cv::resize(scene.person().mask, twice.person().mask, {}, 2, 2, cv::INTER_NEAREST);
  for (cv::Point2f& point : twice.points) point *= 2;
  for (const double time_s : {100.0, 99.9}) {
    scene.segmentation.timestamp_s = twice.segmentation.timestamp_s = time_s;
    const FeatureLabels labels = scene.filtered(), others = twice.filtered();
    for (std::size_t i = 0; i < labels.size(); ++i) {
      ASSERT_EQ(labels[i].reason, others[i].reason) << scene.points[i];
      ASSERT_NEAR(labels[i].score, others[i].score, 1e-6) << scene.points[i];
    }
    const InstanceStatistics statistics = labels.statistics().instances[0];
    EXPECT_EQ(statistics.sampled, others.statistics().instances[0].sampled);
    EXPECT_GT(statistics.passed_depth, 50U);
    EXPECT_GT(statistics.passed_nearness, 30U);
    EXPECT_GT(labels.statistics().kept(), 100U);
  }
}

}  // namespace
}  // namespace dynfilter::testing
