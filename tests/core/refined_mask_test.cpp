// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// DepthCompensator::refined applies the rule to every pixel.

#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>
#include <vector>

#include "dynfilter/dynfilter.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

/// Person at 1.5 m in front of a wall at 4 m. The mask covers the person's left half; a strip on
/// the right has no depth.
struct RefinedScene {
  FrameView frame;
  Segmentation segmentation;
  cv::Rect person{200, 100, 120, 300};

  explicit RefinedScene(double age_s = 0) {
    cv::Mat depth(480, 640, CV_16UC1, cv::Scalar(20000));
    depth(person).setTo(7500);
    depth(cv::Rect(320, 100, 6, 300)).setTo(0);
    frame.depth = depth;
    frame.metres_per_unit = 1.0 / 5000;
    frame.timestamp_s = 100;
    segmentation.timestamp_s = 100 - age_s;
    segmentation.image_size = depth.size();
    Instance instance = Instance::from_box(person, 0, 0.9F);
    instance.mask_origin = {180, 100};
    instance.mask = cv::Mat(300, 80, CV_8UC1, cv::Scalar(255));
    segmentation.instances.push_back(instance);
  }

  Instance refined() const { return DepthCompensator().refined(frame, segmentation, 0); }
};

TEST(RefinedMask, CoversTheWholePersonAndAFreshMask) {
  const Instance refined = RefinedScene().refined();
  EXPECT_TRUE(refined.covers({315, 390})) << "the mask missed it";
  EXPECT_TRUE(refined.covers({185, 200})) << "on the wall, and on the mask";
  EXPECT_FALSE(refined.covers({340, 200})) << "the wall";
  EXPECT_EQ(refined.box, RefinedScene().person);
}

TEST(RefinedMask, EqualsTheMaskWithoutDepth) {
  RefinedScene scene;
  scene.frame.depth.setTo(0);
  const Instance refined = scene.refined();
  EXPECT_EQ(refined.mask.data, scene.segmentation.instances[0].mask.data);
  EXPECT_EQ(refined.mask_origin, scene.segmentation.instances[0].mask_origin);
}

TEST(RefinedMask, CutsHolesIntoDepthForMapping) {
  const RefinedScene scene;
  Segmentation refined = scene.segmentation;
  refined.instances[0] = scene.refined();
  const cv::Mat holes = depth_with_holes(scene.frame.depth, refined);
  EXPECT_EQ(holes.at<std::uint16_t>(390, 315), 0);
  EXPECT_EQ(holes.at<std::uint16_t>(390, 340), 20000);
  EXPECT_EQ(depth_with_holes(scene.frame.depth, scene.segmentation).at<std::uint16_t>(390, 315),
            7500);
}

TEST(RefinedMask, RefusesAnInstanceOutOfRange) {
  const RefinedScene scene;
  expect_error<std::invalid_argument>(
      [&] { (void)DepthCompensator().refined(scene.frame, scene.segmentation, 1); },
      "DepthCompensator::refined");
}

}  // namespace
}  // namespace dynfilter::testing
