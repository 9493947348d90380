// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hand-made cases. whole_filter_test.cpp compares with the oracle, dynamic_filter_test.cpp checks
// properties.

#include "dynfilter/depth_compensator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

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

TEST(DepthCompensator, KeepsTheWallUpToTheEdge) {
  DepthScene scene;
  for (const auto& [x, y] : {std::pair(400.0F, 400.0F),
                             {401.0F, 210.0F},
                             {362.0F, 300.0F},
                             {278.0F, 300.0F},
                             {300.0F, 118.0F}}) {
    EXPECT_EQ(scene.at(x, y).reason, Reason::untouched) << x << ", " << y;
  }
}

TEST(DepthCompensator, ObjectReachesItsHalfWidthEachWay) {
  DepthScene scene;
  const cv::Rect patch(380, 300, 5, 5);  // 20 pixels from the body: no nearness
  for (const auto& [depth_m, taken] :
       {std::pair(1.94, true), {1.96, false}, {1.06, true}, {1.04, false}}) {
    scene.set_depth(patch, depth_m);
    EXPECT_EQ(scene.compensates(382, 302), taken) << depth_m;
  }
  scene.options.half_width_m = 0.5;
  EXPECT_TRUE(scene.compensates(382, 302)) << "1.04 m";
}

/// The strip beside the body has no depth, as the sensor's shadow. The body's edge, column 359,
/// votes in three directions.
TEST(DepthCompensator, NearnessDecidesInHoles) {
  DepthScene scene;
  scene.set_depth({360, 300, 40, 60}, 0);
  EXPECT_TRUE(scene.compensates(362, 330)) << "3 / 3: enough in the shadow of a fresh mask";
  EXPECT_NEAR(scene.at(362, 330).score, 0.8 * (0.5 + 1.0 / 8), 1e-6);
  const FeatureLabel suspect = scene.at(363, 330);
  EXPECT_FALSE(suspect.removed) << "3 / 4";
  EXPECT_EQ(suspect.instance, 0);
  EXPECT_NEAR(suspect.score, 0.8 * 0.5 * 0.75, 1e-6) << "below half the confidence";
  EXPECT_EQ(scene.at(380, 330).score, 0) << "out of reach";
  scene.segmentation.timestamp_s = 99.9;
  EXPECT_TRUE(scene.compensates(365, 330)) << "3 / 6: a stale mask says nothing about shadows";
  EXPECT_FALSE(scene.compensates(366, 330)) << "3 / 7";
  EXPECT_NEAR(scene.at(366, 330).score, 0.8 * 0.5 * (3.0 / 7) / 0.45, 1e-6);
}

TEST(DepthCompensator, MaskMarginRemovesBesideAFreshMask) {
  DepthScene scene;
  EXPECT_FALSE(scene.compensates(361, 300)) << "2 pixels from the mask, wall around";
  scene.options.mask_margin_px = 2.2;
  EXPECT_TRUE(scene.compensates(361, 300));
  EXPECT_EQ(scene.at(361, 300).score, 0.8F);
  EXPECT_FALSE(scene.compensates(362, 300));
  scene.segmentation.timestamp_s = 99.9;
  EXPECT_FALSE(scene.compensates(361, 300)) << "a stale mask has no margin";
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
  EXPECT_TRUE(scene.compensates(360, 330)) << "gap and margin: 7 pixels";
  EXPECT_FALSE(scene.compensates(361, 330));
  EXPECT_EQ(scene.filtered().statistics().instances[0].mask_gap_px, 6.0);
  scene.segmentation.timestamp_s = 99.9;
  EXPECT_EQ(scene.filtered().statistics().instances[0].mask_gap_px, 0.0) << "stale";
}

/// A table 0.25 m behind the person reaches from inside the box to the image's border.
TEST(DepthCompensator, KeepsWhatIsConnectedWithTheSurroundings) {
  DepthScene scene;
  scene.set_depth({360, 340, 280, 40}, 1.75);
  EXPECT_EQ(scene.at(390, 360).reason, Reason::untouched);
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

TEST(DepthCompensator, BoxStandsInForAMaskThatTellsNothing) {
  DepthScene scene;
  for (const int kind : {0, 1, 2}) {
    scene.set_depth(scene.limb, 1.5);
    scene.person() = Instance::from_box(scene.box, 0, 0.8F);
    if (kind == 1) scene.person().mask = cv::Mat(8, 8, CV_8UC1, cv::Scalar(0));
    if (kind == 2) {  // one limb, before the body
      scene.set_depth(scene.limb, 0.9);
      scene.person().mask_origin = scene.limb.tl();
      scene.person().mask = cv::Mat(scene.limb.size(), CV_8UC1, cv::Scalar(1));
    }
    EXPECT_EQ(scene.compensates(390, 210), kind != 2) << kind;
    EXPECT_TRUE(scene.compensates(300, 300)) << kind;
    EXPECT_FALSE(scene.compensates(400, 400)) << kind;
  }
}

TEST(DepthCompensator, KeepsFeaturesNearerThanTheObject) {
  DepthScene scene;
  scene.set_depth({378, 208, 5, 5}, 0.7);
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

TEST(DepthCompensator, AcceptsPositionsOutsideTheImage) {
  DepthScene scene;
  constexpr float beyond = std::numeric_limits<float>::infinity();
  scene.person().box = {-1000, -1000, 5000, 5000};
  scene.points = {{-1, 300},     {640, 300},      {300, -1},
                  {300, 480},    {1e30F, 300},    {std::nanf(""), 300},
                  {300, beyond}, {-beyond, 2e9F}, {-0.6F, -0.6F},
                  {390, 210}};
  for (const double time_s : {100.0, 99.9}) {
    scene.segmentation.timestamp_s = time_s;
    const FeatureLabels labels = scene.filtered();
    EXPECT_EQ(labels.statistics().removed(), 1U);
    EXPECT_TRUE(labels.is_removed(9));
    EXPECT_EQ(labels.statistics().instances[0].candidates, 1U);
  }
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

/// Ages of powers of two are exact.
TEST(DepthCompensator, MasksAreStaleBetweenTwoAges) {
  DepthScene scene;
  scene.make_stale();
  scene.options.stale_age_s = 1.0 / 32;
  const double step = 1.0 / 1024;
  for (const auto& [age_s, is_stale] : {std::pair(0.0, false),
                                        {1.0 / 32, false},
                                        {1.0 / 32 + step, true},
                                        {-1.0 / 32 - step, true},
                                        {1.0, true},
                                        {1 + step, false},
                                        {50.0, false}}) {
    scene.segmentation.timestamp_s = scene.frame.timestamp_s - age_s;
    EXPECT_EQ(scene.at(270, 300).reason == Reason::restored, is_stale) << age_s;
  }
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
  expect_reach(6, 6);
  scene.segmentation.timestamp_s = 99.96875;  // 12.5 pixels
  expect_reach(19, 12);
  scene.options.motion_px_per_s = 0;
  expect_reach(6, 6);
}

}  // namespace
}  // namespace dynfilter::testing
