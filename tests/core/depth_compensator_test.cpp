// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hand-made cases. whole_filter_test.cpp compares with the oracle, dynamic_filter_test.cpp checks
// properties.

#include "dynfilter/depth_compensator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <opencv2/imgproc.hpp>

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
  EXPECT_NEAR(statistics.depth_range_m.lower, 1.1, 1e-6);
  EXPECT_NEAR(statistics.depth_range_m.upper, 1.9, 1e-6);
}

TEST(DepthCompensator, KeepsTheWallUpToTheEdge) {
  DepthScene scene;
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
  DepthScene scene;
  scene.person().mask_origin.x = 265;         // on the wall, so that its depth is not the object's
  scene.options.mask_gap.min_samples = 1000;  // no gap is known
  scene.options.min_nearness = 100;           // no nearness suffices
  EXPECT_TRUE(scene.compensates(264, 300));
  EXPECT_EQ(scene.at(264, 300).score, 0.8F);
  EXPECT_FALSE(scene.compensates(263, 300));
  EXPECT_FALSE(scene.compensates(264, 440)) << "1.4 pixels from the corner";
  scene.options.mask_margin_px = 1.5;
  EXPECT_TRUE(scene.compensates(264, 440));
  scene.options.mask_margin_px = 0;
  EXPECT_FALSE(scene.compensates(264, 300));
}

TEST(DepthCompensator, WithoutAMarginTakesNothingOnTheMaskThatWasGivenBack) {
  DepthScene scene;
  scene.person().mask_origin.x = 265;  // on the wall up to column 279
  scene.options.mask_gap.min_samples = 1000;
  scene.options.min_nearness = 100;
  scene.points = {{270, 300}};
  for (const double margin_px : {0.0, 1.0}) {
    scene.options.mask_margin_px = margin_px;
    const auto give_back = [](const FilterInput&, FeatureLabels& labels) { labels.restore(0); };
    const FeatureLabels labels = Pipeline(MaskCuller(), give_back, DepthCompensator(scene.options))
                                     .apply(scene.frame, scene.segmentation, scene.points);
    EXPECT_EQ(labels.is_removed(0), margin_px > 0) << margin_px;
  }
}

TEST(DepthCompensator, ObjectReachesFortyCentimetresEachWay) {
  DepthScene scene;
  const cv::Rect patch(380, 300, 5, 5);  // 20 pixels from the body: no nearness
  for (const auto& [depth_m, taken] :
       {std::pair(1.89, true), {1.91, false}, {1.11, true}, {1.09, false}}) {
    scene.set_depth(patch, depth_m);
    EXPECT_EQ(scene.compensates(382, 302), taken) << depth_m;
  }
}

TEST(DepthCompensator, RemovesFeaturesInHolesNearTheObject) {
  DepthScene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  scene.options.shadow_px = 0;
  // The body's edge, 359, is 4 pixels to the left in three directions: 3 / 4.
  EXPECT_TRUE(scene.compensates(363, 330));
  EXPECT_NEAR(scene.at(363, 330).score, 0.8 * (0.5 + 0.75 / 8), 1e-6);
  EXPECT_TRUE(scene.compensates(365, 330)) << "3 / 6 is just enough";
  EXPECT_FALSE(scene.compensates(366, 330)) << "3 / 7 is not";
  EXPECT_FALSE(scene.compensates(380, 330));
  const InstanceStatistics statistics = [&] {
    scene.points = {{363, 330}, {366, 330}};
    return scene.filtered().statistics().instances[0];
  }();
  EXPECT_EQ(statistics.candidates, 2U);
  EXPECT_EQ(statistics.passed_depth, 0U);
  EXPECT_EQ(statistics.passed_nearness, 1U);
}

TEST(DepthCompensator, NearnessOfZeroRemovesNothingWhateverTheMinimum) {
  DepthScene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  scene.options.shadow_px = 0;
  scene.options.min_nearness = 0;
  EXPECT_TRUE(scene.compensates(366, 330)) << "3 / 7";
  EXPECT_EQ(scene.at(380, 330).score, 0.0F);
  EXPECT_FALSE(scene.compensates(380, 330)) << "the object is out of reach";
}

/// The strip beside the body has no depth, as the sensor's shadow, and shows the wall.
TEST(DepthCompensator, NeedsMoreNearnessInTheShadowOfAFreshMask) {
  DepthScene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  EXPECT_TRUE(scene.compensates(362, 330)) << "3 / 3";
  EXPECT_FALSE(scene.compensates(363, 330)) << "3 / 4";
  scene.options.min_nearness_in_shadow = 0.75;
  EXPECT_TRUE(scene.compensates(363, 330));
  scene.options.min_nearness_in_shadow = 0.9;
  scene.options.shadow_px = 3.5;  // the feature lies 4 pixels from the mask
  EXPECT_TRUE(scene.compensates(363, 330));
  scene.options.shadow_px = 8;
  scene.segmentation.timestamp_s = 99.9;
  EXPECT_TRUE(scene.compensates(363, 330)) << "a stale mask says nothing about shadows";
}

TEST(DepthCompensator, KeptFeaturesHaveScoresBelowHalfTheConfidence) {
  DepthScene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  const FeatureLabel suspect = scene.at(366, 330);  // nearness 3 / 7; the minimum is 0.9 there
  EXPECT_EQ(suspect.reason, Reason::untouched);
  EXPECT_EQ(suspect.instance, 0);
  EXPECT_NEAR(suspect.score, 0.8 * 0.5 * (3.0 / 7) / 0.9, 1e-6);
  const FeatureLabel far_off = scene.at(380, 330);
  EXPECT_EQ(far_off.instance, -1);
  EXPECT_EQ(far_off.score, 0);
}

/// The strip beside a mask that is too small has no depth.
TEST(DepthCompensator, CountsAFreshMaskAmongWhatIsNear) {
  DepthScene scene;
  scene.set_depth({340, 300, 60, 60}, 0);
  scene.options.mask_gap.min_samples = 1000;
  scene.options.shadow_px = scene.options.mask_margin_px = 0;
  EXPECT_TRUE(scene.compensates(365, 330)) << "3 / 6 by the mask, without the body's depth";
  EXPECT_FALSE(scene.compensates(366, 330)) << "3 / 7";
  scene.segmentation.timestamp_s = 99.9;
  EXPECT_FALSE(scene.compensates(365, 330)) << "a stale mask may lie elsewhere";
}

/// The depth image is seven pixels late: the person was further to the left in it.
TEST(DepthCompensator, ReadsDepthWhereTheObjectWas) {
  DepthScene scene;
  scene.set_depth({0, 0, 640, 480}, 4.0);
  scene.set_depth({273, 100, 80, 340}, 1.5);
  scene.set_depth({385, 300, 10, 60}, 1.5);  // as a hand that the mask misses
  EXPECT_EQ(scene.at(274, 330).reason, Reason::untouched) << "wall with the person's depth";
  EXPECT_TRUE(scene.compensates(396, 330)) << "hand with the wall's depth";
  EXPECT_EQ(scene.at(389, 330).reason, Reason::untouched) << "wall with the hand's depth";
  EXPECT_EQ(scene.filtered().statistics().instances[0].depth_shift_px, -7.0);
  scene.options.mask_gap.min_shift_px = 7.5;
  EXPECT_TRUE(scene.compensates(274, 330));
  EXPECT_TRUE(scene.compensates(389, 330));
  EXPECT_EQ(scene.filtered().statistics().instances[0].depth_shift_px, 0.0);
}

/// A wall 0.55 m behind the person, a little beyond his range of depth. The mask covers a strip of
/// it in the depth image, from which the wall is not the person's.
TEST(DepthCompensator, FloodsFromWhereTheObjectWas) {
  DepthScene scene;
  scene.set_depth({0, 0, 640, 480}, 2.05);
  scene.set_depth({268, 120, 80, 320}, 1.5);  // 12 pixels to the left
  for (const cv::Point2f wall : {cv::Point2f(380, 300), {400, 200}, {270, 200}, {374, 400}}) {
    EXPECT_EQ(scene.at(wall.x, wall.y).reason, Reason::untouched) << wall;
  }
  EXPECT_EQ(scene.filtered().statistics().instances[0].depth_shift_px, -12.0);
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

/// The mask is six pixels too small on either side, which the depth shows.
TEST(DepthCompensator, MeasuresTheMarginThatTheMaskNeeds) {
  DepthScene scene;
  scene.person().mask_origin.x += 6;
  scene.person().mask = scene.person().mask.colRange(0, 68).clone();  // columns 286 to 353
  scene.set_depth({350, 300, 10, 60}, 4.0);  // the wall's depth on the person, as out of step
  EXPECT_TRUE(scene.compensates(357, 330)) << "four pixels from the mask";
  EXPECT_TRUE(scene.compensates(360, 330)) << "gap and margin: 7 pixels";
  EXPECT_FALSE(scene.compensates(361, 330));
  EXPECT_EQ(scene.filtered().statistics().instances[0].mask_gap_px, 6.0);
  scene.options.mask_gap.max_gap_px = 3;
  EXPECT_FALSE(scene.compensates(358, 330));
  scene.segmentation.timestamp_s = 99.9;
  scene.filtered();
  EXPECT_EQ(scene.filtered().statistics().instances[0].mask_gap_px, 0.0) << "stale";
}

/// A table 0.25 m behind the person reaches from inside the box to the image's border.
TEST(DepthCompensator, KeepsATableBehindThePerson) {
  DepthScene scene;
  scene.set_depth({360, 340, 280, 40}, 1.75);
  EXPECT_EQ(scene.at(390, 360).reason, Reason::untouched);
  scene.options.min_off_middle_m = 0.3;
  EXPECT_TRUE(scene.compensates(390, 360)) << "without the watershed";
  scene.options.min_off_middle_m = 0.15;
  scene.set_depth({412, 0, 228, 480}, 4.0);  // now it ends inside the box, like an arm
  EXPECT_TRUE(scene.compensates(390, 360));
}

TEST(DepthCompensator, KeepsAChairBeforeThePerson) {
  DepthScene scene;
  scene.set_depth({360, 340, 280, 40}, 1.25);
  EXPECT_EQ(scene.at(390, 360).reason, Reason::untouched);
  scene.segmentation.timestamp_s = 99.9;
  EXPECT_TRUE(scene.compensates(390, 360)) << "the person may have come nearer since";
}

/// An arm that reaches 0.5 m towards the camera, in small steps.
TEST(DepthCompensator, FollowsAnArmBeyondTheRangeOfDepth) {
  DepthScene scene;
  for (int x = 360; x < 420; ++x) scene.set_depth({x, 200, 1, 20}, 1.5 - 0.009 * (x - 360));
  scene.options.max_step_m = 0.2;
  EXPECT_TRUE(scene.compensates(407, 210)) << "0.42 m before the body";
  scene.options.max_beyond_range_m = 0;
  EXPECT_FALSE(scene.compensates(407, 210));
  scene.options.max_beyond_range_m = 0.3;
  scene.options.max_step_m = 0.1;
  EXPECT_FALSE(scene.compensates(407, 210)) << "a cell of 16 pixels rises by 0.14 m";
}

TEST(DepthCompensator, WorksWithABoxAlone) {
  DepthScene scene;
  scene.segmentation.instances = {Instance::from_box(scene.box, 0, 0.8F)};
  EXPECT_TRUE(scene.compensates(390, 210));
  EXPECT_TRUE(scene.compensates(300, 300));
  EXPECT_FALSE(scene.compensates(400, 400));
  const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
  EXPECT_EQ(statistics.compensation, Compensation::applied);
  EXPECT_NEAR(statistics.depth_range_m.lower, 1.1, 1e-6);
}

TEST(DepthCompensator, HoleInsideTheObjectRaisesTheScore) {
  DepthScene scene;
  scene.person().mask.rowRange(160, 320).setTo(0);
  scene.set_depth({318, 398, 5, 5}, 0);
  EXPECT_NEAR(scene.at(320, 400).score, 0.8 * std::min(1.0, 0.5 + 10.0 / 3 / 8), 1e-6);
  scene.set_depth({318, 398, 5, 5}, 1.5);
  scene.set_depth({320, 400, 1, 1}, 4);  // the background's depth, as at edges of thin limbs
  EXPECT_NEAR(scene.at(320, 400).score, 0.8, 1e-6) << "the score is at most the confidence";
}

TEST(DepthCompensator, KeepsFeaturesNearerThanTheObject) {
  DepthScene scene;
  scene.set_depth({378, 208, 5, 5}, 1.0);
  EXPECT_EQ(scene.at(380, 210).reason, Reason::untouched);
  scene.set_depth({378, 208, 5, 5}, 0);
  EXPECT_TRUE(scene.compensates(380, 210)) << "the limb surrounds it";
}

/// An object closer to the lens than its minimum width must not remove all features without depth.
TEST(DepthCompensator, HandBeforeTheLensDoesNotRemoveDistantHoles) {
  DepthScene scene;
  scene.set_depth(scene.body, 0.3);
  scene.set_depth({380, 300, 40, 60}, 0);
  EXPECT_EQ(scene.at(400, 330).reason, Reason::untouched);
  EXPECT_TRUE(scene.compensates(360, 290)) << "the mask's margin";
}

TEST(DepthCompensator, AbstainsIfTheObjectIsBeyondTheSensorRange) {
  DepthScene scene;
  scene.frame.metres_per_unit = 0.01;  // the body at 75 m
  scene.set_depth({360, 300, 40, 60}, 0);
  EXPECT_EQ(scene.at(380, 330).reason, Reason::untouched);
  EXPECT_EQ(scene.filtered().statistics().instances[0].compensation, Compensation::too_few_samples);
}

TEST(DepthCompensator, EmptyMaskFallsBackToTheBox) {
  DepthScene scene;
  scene.person().mask = cv::Mat();
  EXPECT_TRUE(scene.compensates(390, 210));
  EXPECT_TRUE(scene.compensates(300, 300));
  EXPECT_FALSE(scene.compensates(400, 400));
}

TEST(DepthCompensator, MaskOfOneLimbFallsBackToTheBox) {
  DepthScene scene;
  scene.set_depth(scene.limb, 0.9);
  scene.person().mask_origin = scene.limb.tl();
  scene.person().mask = cv::Mat(scene.limb.size(), CV_8UC1, cv::Scalar(1));
  EXPECT_EQ(scene.at(390, 210).reason, Reason::in_mask);
  scene.options.object_depth.min_mask_share = 0.01;
  EXPECT_FALSE(scene.compensates(300, 300));
  scene.options.object_depth.min_mask_share = 0.02;
  EXPECT_TRUE(scene.compensates(300, 300));
  EXPECT_FALSE(scene.compensates(400, 400));
}

/// Two persons in one detection, each with some relief; features beside their common mask.
TEST(DepthCompensator, RemovesTwoTouchingPersonsInOneDetection) {
  for (const double second_m : {1.9, 3.0}) {
    DepthScene scene;
    for (int x = 280; x < 400; ++x) {
      const double relief_m = 0.1 * ((x - 280) % 40) / 40;
      scene.set_depth({x, 120, 1, 320}, (x < 340 ? 1.5 : second_m) + relief_m);
    }
    scene.person().mask = cv::Mat(320, 110, CV_8UC1, cv::Scalar(255));  // columns up to 390
    EXPECT_EQ(scene.compensates(395, 300), second_m == 1.9) << second_m;
    EXPECT_EQ(scene.at(300, 300).reason, Reason::in_mask);
  }
}

TEST(DepthCompensator, AbstainsWithoutDepth) {
  DepthScene scene;
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
  DepthScene scene;
  scene.options.object_depth.max_places = 2000;  // every fourth pixel
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
  DepthScene scene;
  scene.person().class_id = 56;
  EXPECT_EQ(scene.at(390, 210).reason, Reason::untouched);
  const InstanceStatistics statistics = scene.filtered().statistics().instances[0];
  EXPECT_EQ(statistics.compensation, Compensation::not_run);
  EXPECT_EQ(statistics.candidates, 0U);
}

TEST(DepthCompensator, FeatureGoesToTheFirstInstanceThatAcceptsIt) {
  DepthScene scene;
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
  DepthScene scene;
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

/// Doubles width and height: each pixel becomes four. Features are at the upper left one, so only
/// distances to the right and downwards double exactly.
TEST(DepthCompensator, LabelsDoNotDependOnImageScale) {
  DepthScene scene;
  scene.set_depth({262, 300, 18, 60}, 0);  // a hole to the left of the body
  for (int y = 101; y < 460; y += 3) {
    const bool nearly_in_hole = (y > 290 && y < 313) || (y > 347 && y < 370);
    for (int x = 250; x < 279 && !nearly_in_hole; x += 2) scene.points.emplace_back(x, y);
    for (int x = 362; x < 430; x += 4) scene.points.emplace_back(x, y);
  }
  DepthScene twice = scene;
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
    EXPECT_GT(statistics.passed_nearness, 10U);
    EXPECT_GT(labels.statistics().kept(), 100U);
  }
}

}  // namespace
}  // namespace dynfilter::testing
