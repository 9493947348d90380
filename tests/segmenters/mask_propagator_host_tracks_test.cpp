// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Masks that are moved by the host's own tracks.

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/propagator_scene.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

/// Points every 8 pixels that all move by a step.
std::vector<PointMotion> tracks_of(cv::Point step) {
  std::vector<PointMotion> motions;
  for (int y = 4; y < scene_size.height; y += 8) {
    for (int x = 4; x < scene_size.width; x += 8) {
      const cv::Point2f from(static_cast<float>(x), static_cast<float>(y));
      motions.push_back({from, from + cv::Point2f(step)});
    }
  }
  return motions;
}

/// Frame without an image; its depth image tells its scene_size.
FrameView frame_without_image(int index) {
  FrameView frame = frame_of(cv::Mat(), index);
  frame.depth = cv::Mat1f(scene_size, 1.0F);
  return frame;
}

void expect_moved(const std::optional<Segmentation>& moved, Instance object, cv::Point shift) {
  ASSERT_TRUE(moved);
  ASSERT_EQ(moved->instances.size(), 1U);
  object.mask_origin += shift;
  EXPECT_TRUE(same(painted(*moved), painted(Segmentation{0, 0, scene_size, {object}})));
}

TEST(MaskPropagatorByHostsTracks, MovesByThemAndNeedsNoImage) {
  const cv::Point step(5, -3);
  const Instance object = ring({130, 140}, 45);
  MaskPropagator propagator;
  const Segmentation result = result_of(frame_without_image(0), {object});
  for (int i = 0; i <= 6; ++i) {
    const auto moved = propagator.propagate(frame_without_image(i), result, tracks_of(step));
    expect_moved(moved, object, i * step);
    EXPECT_EQ(propagator.statistics().instances.at(0).by_flow, static_cast<std::size_t>(i));
    // The points of the last column leave the image.
    EXPECT_EQ(propagator.statistics().tracked_points, i == 0 ? 0U : 39U * 30U);
  }
}

TEST(MaskPropagatorByHostsTracks, TakeThePlaceOfThoseInTheImage) {
  const Pan pan({7, 0});
  const Instance object = ring({150, 120}, 45);
  MaskPropagator propagator;
  const Segmentation result = result_of(pan.frame(0), {object});
  propagator.propagate(pan.frame(0), result);
  expect_moved(propagator.propagate(pan.frame(1), result, tracks_of({0, 6})), object, {0, 6});
  // The image of frame 0 is no more the last one, so nothing is tracked from it into frame 2, and
  // the instance goes on by its velocity.
  expect_moved(propagator.propagate(pan.frame(2), result), object, {0, 12});
  EXPECT_EQ(propagator.statistics().tracked_points, 0U);
  EXPECT_EQ(propagator.statistics().instances.at(0).by_velocity, 1U);
  expect_moved(propagator.propagate(pan.frame(3), result), object, {7, 12});
}

TEST(MaskPropagatorByHostsTracks, AreRefusedAtPlacesThatAreNotFinite) {
  MaskPropagator propagator;
  const Segmentation result = result_of(frame_without_image(0), {ring({150, 120}, 45)});
  propagator.propagate(frame_without_image(0), result, {});
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (const PointMotion& motion :
         {PointMotion{{bad, 1}, {1, 1}}, PointMotion{{1, 1}, {1, bad}}}) {
      expect_error<std::invalid_argument>(
          [&] { propagator.propagate(frame_without_image(1), result, {motion}); },
          "MaskPropagator");
    }
  }
  EXPECT_TRUE(propagator.propagate(frame_without_image(1), result, tracks_of({1, 0})))
      << "nothing was changed";
  EXPECT_FALSE(propagator.statistics().restarted);
}

}  // namespace
}  // namespace dynfilter::testing
