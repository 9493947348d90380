// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "scene_measures.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace dynfilter::tools {
namespace {

constexpr int wall = 20000;  // 4 m
constexpr int body = 7500;   // 1.5 m

/// Paints a person, 60 x 120 px, at column x.
cv::Mat1w depth_at(int x) {
  cv::Mat1w depth(240, 320, std::uint16_t{wall});
  depth(cv::Rect(x, 80, 60, 120)).setTo(body);
  return depth;
}

Segmentation masks_at(int x, int class_id = 0) {
  cv::Mat1b mask(240, 320, std::uint8_t{0});
  mask(cv::Rect(x, 80, 60, 120)).setTo(255);
  Segmentation segmentation;
  segmentation.image_size = {320, 240};
  segmentation.instances = {Instance::from_image_mask(mask)};
  segmentation.instances[0].class_id = class_id;
  return segmentation;
}

/// Measures a person who walks by `step_px` a frame, with depth that is `late_px` behind.
std::optional<double> measured(int step_px, int late_px, int frames = 20) {
  DepthLateness lateness;
  for (int i = 0; i < frames; ++i) {
    lateness.add(depth_at(40 + step_px * i - late_px), masks_at(40 + step_px * i));
  }
  return lateness.frames();
}

TEST(DepthLateness, CountsFramesOfOffset) {
  EXPECT_NEAR(measured(6, 0).value(), 0, 0.01);
  EXPECT_NEAR(measured(6, 6).value(), 1, 0.01);
  EXPECT_NEAR(measured(6, -6).value(), -1, 0.01);
  EXPECT_NEAR(measured(6, 12).value(), 2, 0.01);
  EXPECT_NEAR(measured(6, 3).value(), 0.5, 0.05);
  EXPECT_NEAR(measured(6, -2).value(), -1 / 3.0, 0.05);
}

/// A body is what lies within 2 % of its middle half, both ends included.
TEST(DepthLateness, CountsTheWholeRangeOfABody) {
  for (const int side : {body - body / 50, body + body / 50}) {
    DepthLateness lateness;
    for (int i = 0; i < 20; ++i) {
      cv::Mat1w depth = depth_at(40 + 6 * i);
      depth(cv::Rect(40 + 6 * i, 80, 14, 120)).setTo(side);
      lateness.add(depth, masks_at(40 + 6 * i));
    }
    EXPECT_NEAR(lateness.frames().value(), 0, 0.01) << side;
  }
}

TEST(DepthLateness, AbstainsWhereNobodyMovesAndWithoutFrames) {
  EXPECT_FALSE(measured(0, 0).has_value());
  EXPECT_FALSE(measured(6, 0, 7).has_value());
  DepthLateness lateness;
  for (int i = 0; i < 20; ++i) lateness.add(depth_at(40), Segmentation{});
  EXPECT_FALSE(lateness.frames().has_value());
}

std::string counted(const cv::Mat1w& depth, const Segmentation& masks,
                    const std::vector<cv::KeyPoint>& keypoints) {
  StaticAtPersonsDepth counts;
  counts.add(depth, 5000, masks, keypoints);
  return counts.text();
}

TEST(StaticAtPersonsDepth, CountsFeaturesInTheBoxByTheirDepth) {
  cv::Mat1w depth = depth_at(100);
  Segmentation masks = masks_at(100);
  masks.instances[0].box = {60, 80, 140, 120};          // 40 px wider on both sides
  depth(cv::Rect(60, 150, 20, 10)).setTo(body + 400);   // 0.08 m behind
  depth(cv::Rect(60, 160, 20, 10)).setTo(body - 1400);  // 0.28 m before
  depth(cv::Rect(60, 170, 20, 10)).setTo(body + 1600);  // 0.32 m behind
  depth(cv::Rect(60, 180, 20, 10)).setTo(0);
  depth(cv::Rect(20, 150, 20, 10)).setTo(body);                // outside the box
  const std::vector<cv::KeyPoint> keypoints = {{130, 100, 7},  // on the mask
                                               {98, 155, 7},   // in the smaller rim
                                               {90, 100, 7},   // in the wider rim only, far away
                                               {70, 155, 7},  {70, 165, 7},
                                               {70, 175, 7},  {70, 185, 7},  // on the furniture
                                               {30, 155, 7}};
  const std::string text = counted(depth, masks, keypoints);
  // all, in boxes, within 0.10 m, within 0.30 m, % of those in boxes
  EXPECT_NE(text.find("   6.0    5.0    1.0    2.0   20.0   40.0\n"), std::string::npos) << text;
  EXPECT_NE(text.find("   5.0    4.0    1.0    2.0   25.0   50.0\n"), std::string::npos) << text;
}

TEST(StaticAtPersonsDepth, LooksAtPersonsOnly) {
  const std::string text = counted(depth_at(100), masks_at(100, 62), {{130, 100, 7}});
  EXPECT_NE(text.find("   1.0    0.0    0.0    0.0    0.0    0.0\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace dynfilter::tools
