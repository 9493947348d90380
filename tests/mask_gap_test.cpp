// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hand-made cases. whole_filter_test.cpp compares the gaps in the statistics with an oracle.

#include "dynfilter/mask_gap.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

/// A wall at 4 m and a person at 1.5 m in columns 200 to 299. The mask is smaller by some pixels on
/// the left and on the right.
struct GapScene {
  FrameView frame;
  Instance instance;
  ObjectDepth object;

  GapScene(int left, int right) {
    frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(4.0F));
    frame.depth(cv::Rect(200, 100, 100, 300)).setTo(1.5F);
    instance.mask_origin = {200 + left, 100};
    instance.mask = cv::Mat(300, 100 - left - right, CV_8UC1, cv::Scalar(255));
    object.mask_range_m = {1.1, 1.9};
  }

  std::optional<double> gap(const MaskGapOptions& options = {}) const {
    return MaskGapEstimator(options).estimate(frame, instance, object);
  }
};

TEST(MaskGap, IsTheDistanceFromTheMaskToTheObjectsEdge) {
  for (int pixels = 0; pixels <= 12; ++pixels) EXPECT_EQ(GapScene(pixels, pixels).gap(), pixels);
}

/// A depth image of another time shifts the object: the gaps of both sides make up for it.
TEST(MaskGap, DoesNotDependOnAShiftOfTheDepthImage) {
  EXPECT_EQ(GapScene(2, 10).gap(), 6.0);
  EXPECT_EQ(GapScene(10, 2).gap(), 6.0);
}

TEST(MaskGap, IsLimited) {
  EXPECT_EQ(GapScene(20, 20).gap(), 16.0);
  MaskGapOptions options;
  options.max_gap_px = 5;
  EXPECT_EQ(GapScene(8, 8).gap(options), 5.0);
}

TEST(MaskGap, IsUnknownWhereTheObjectsDepthGoesOn) {
  GapScene scene(4, 4);
  scene.frame.depth.setTo(1.5F);
  EXPECT_FALSE(scene.gap().has_value());
  EXPECT_FALSE(GapScene(40, 40).gap().has_value()) << "beyond the reach";
}

TEST(MaskGap, NeedsThreePixelsBehindTheObjectWithinItsReach) {
  MaskGapOptions options;
  options.reach_px = 40;
  options.max_gap_px = 100;
  EXPECT_EQ(GapScene(37, 37).gap(options), 37.0);
  EXPECT_FALSE(GapScene(38, 38).gap(options).has_value());
}

TEST(MaskGap, NeedsThreePixelsBehindTheObjectWithinTheImage) {
  GapScene scene(2, 0);
  scene.instance.mask = cv::Mat(300, 429, CV_8UC1, cv::Scalar(255));  // columns 202 to 630
  scene.frame.depth(cv::Rect(200, 100, 437, 300)).setTo(1.5F);        // to column 636
  EXPECT_EQ(scene.gap(), (2.0 + 6.0) / 2);
  scene.frame.depth(cv::Rect(637, 100, 1, 300)).setTo(1.5F);
  EXPECT_EQ(scene.gap(), 2.0) << "by the left side alone";
}

TEST(MaskGap, IgnoresEdgesOfTheMaskThatAreNotTheObjects) {
  EXPECT_FALSE(GapScene(-3, -3).gap().has_value());
}

TEST(MaskGap, IsTheUpperMedian) {
  GapScene scene(4, 4);
  scene.instance.mask = cv::Mat(32, 92, CV_8UC1, cv::Scalar(255));  // four rows
  scene.frame.depth(cv::Rect(196, 116, 108, 100)).setTo(1.5F);      // the lower two are wider
  EXPECT_EQ(scene.gap(), 8.0);
}

TEST(MaskGap, IgnoresPlacesThatTouchSomethingElse) {
  GapScene scene(4, 4);
  scene.frame.depth(cv::Rect(300, 100, 340, 100)).setTo(1.6F);  // a table beside the person
  EXPECT_EQ(scene.gap(), 4.0);
}

TEST(MaskGap, IgnoresHolesOfTwoPixels) {
  GapScene scene(8, 8);
  scene.frame.depth(cv::Rect(295, 100, 2, 300)).setTo(0.0F);
  EXPECT_EQ(scene.gap(), 8.0);
  scene.frame.depth(cv::Rect(295, 100, 3, 300)).setTo(0.0F);
  EXPECT_EQ(scene.gap(), (8.0 + 3.0) / 2) << "three pixels end the object on the right";
}

TEST(MaskGap, IsUnknownWithTooFewPlaces) {
  GapScene scene(4, 4);
  scene.instance.mask = scene.instance.mask.rowRange(0, 24).clone();  // three rows, two sides
  EXPECT_FALSE(scene.gap().has_value());
  scene.instance.mask = cv::Mat(32, 92, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(scene.gap(), 4.0);
}

TEST(MaskGap, ScalesWithTheImage) {
  GapScene scene(0, 0);
  scene.frame.depth = cv::Mat(960, 1280, CV_32FC1, cv::Scalar(4.0F));
  scene.frame.depth(cv::Rect(400, 200, 200, 600)).setTo(1.5F);
  scene.instance.mask_origin = {440, 200};
  scene.instance.mask = cv::Mat(600, 120, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(scene.gap(), 32.0) << "40 pixels, limited to 2 x 16";
}

TEST(MaskGap, IsUnknownWithoutMaskOrDepth) {
  GapScene scene(4, 4);
  scene.instance.mask = cv::Mat();
  EXPECT_FALSE(scene.gap().has_value());
  scene = GapScene(4, 4);
  scene.frame.depth = cv::Mat();
  EXPECT_FALSE(scene.gap().has_value());
}

TEST(MaskGap, RefusesLengthsThatAreNone) {
  MaskGapOptions options;
  for (const double bad : {0.0, -1.0, std::nextafter(1e6, 2e6), std::nan("")}) {
    options.reach_px = bad;
    expect_error<std::invalid_argument>([&] { MaskGapEstimator{options}; },
                                        "MaskGapEstimator: got reach_px = ");
  }
  options.reach_px = 1e6;
  EXPECT_NO_THROW(MaskGapEstimator{options});
}

}  // namespace
}  // namespace dynfilter::testing
