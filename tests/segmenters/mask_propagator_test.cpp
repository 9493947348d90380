// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Motion, age and time of propagated masks.

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <cmath>
#include <optional>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.hpp"
#include "support/propagator_scene.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

// --- Motion that is known exactly ----------------------------------------------------------------

TEST(MaskPropagator, MovesByWholePixelsExactly) {
  for (const cv::Point step : {cv::Point(-3, 2), {7, 7}}) {
    for (const cv::Size image :
         {scene_size, scene_size * 2}) {  // the propagator downscales the latter
      const Pan pan(step, image);
      const Instance object = ring(cv::Point(image) / 2, 50);
      MaskPropagator propagator;
      const Segmentation newest = result_of(pan.frame(0), {object}, image);
      for (int i = 0; i <= 8; ++i) {
        const auto moved = propagator.propagate(pan.frame(i), newest);
        ASSERT_TRUE(moved);
        Instance want = object;
        want.mask_origin += i * step;
        const Segmentation wanted{0, 0, image, {want}};
        EXPECT_TRUE(same(painted(*moved), painted(wanted))) << step << ' ' << image << ' ' << i;
        EXPECT_EQ(moved->instances.at(0).box, object.box + i * step);
      }
    }
  }
}

TEST(MaskPropagator, LateMasksMatchTimelyMasks) {
  const Pan pan({4, -2});
  const Instance object = ring({130, 140}, 45);
  const Segmentation result = result_of(pan.frame(2), {object});
  MaskPropagator propagator;
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(propagator.propagate(pan.frame(i), std::nullopt));
  const auto moved = propagator.propagate(pan.frame(8), result);
  ASSERT_TRUE(moved);
  Instance want = object;
  want.mask_origin += 6 * cv::Point(4, -2);
  EXPECT_TRUE(same(painted(*moved), painted(want)));
  EXPECT_EQ(moved->frame_id, 108U);
  EXPECT_EQ(moved->timestamp_s, result.timestamp_s) << "it tells the masks' age";
}

TEST(MaskPropagator, FollowsTheObjectRatherThanTheBackground) {
  const Patch patch{{60, 70, 80, 100}, 5};
  MaskPropagator propagator;
  std::optional<Segmentation> newest;
  for (int i = 0; i <= 10; ++i) {
    const cv::Point shift(6 * i, -2 * i);
    const FrameView frame = frame_of(image_with({{patch, shift}}), i);
    if (i == 0) newest = result_of(frame, {patch.instance({})});
    const auto moved = propagator.propagate(frame, newest);
    ASSERT_TRUE(moved);
    const Instance want = patch.instance(shift);
    EXPECT_GT(iou(painted(*moved), painted(want)), 0.94) << i;
    EXPECT_LE(cv::norm(moved->instances.at(0).box.tl() - want.box.tl()), 6) << i;
    EXPECT_LE(cv::norm(moved->instances.at(0).box.br() - want.box.br()), 3) << i;
  }
}

TEST(MaskPropagator, PartsOfAnObjectMoveApart) {
  const Patch upper{{90, 40, 110, 70}, 5}, lower{{90, 120, 110, 70}, 6};
  const auto both = [&](cv::Point up, cv::Point down) {
    return Instance::from_image_mask(painted(upper.instance(up)) | painted(lower.instance(down)));
  };
  MaskPropagator propagator;
  std::optional<Segmentation> newest;
  for (int i = 0; i <= 6; ++i) {
    const cv::Point up(5 * i, 0), down(-5 * i, 0);
    const FrameView frame = frame_of(image_with({{upper, up}, {lower, down}}), i);
    if (i == 0) newest = result_of(frame, {both({}, {})});
    const auto moved = propagator.propagate(frame, newest);
    EXPECT_GT(iou(painted(*moved), painted(both(up, down))), 0.9) << i;
  }
}

// --- Without tracked points ----------------------------------------------------------------------

TEST(MaskPropagator, MovesByVelocityWithoutAnImage) {
  const Pan pan({4, 0});
  const Instance object = ring({100, 120}, 40);
  const Segmentation result = result_of(pan.frame(0), {object});
  MaskPropagator propagator;
  for (int i = 0; i <= 4; ++i) propagator.propagate(pan.frame(i), result);
  for (int i = 5; i <= 7; ++i) {
    FrameView blind = pan.frame(i);
    blind.image.release();
    const auto moved = propagator.propagate(blind, result);
    ASSERT_TRUE(moved);
    EXPECT_EQ(moved->instances.at(0).box, object.box + cv::Point(4 * i, 0)) << i;
    EXPECT_TRUE(same(moved->instances.at(0).mask, object.mask));
    EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin + cv::Point(4 * i, 0));
  }
}

TEST(MaskPropagator, LeavesMasksInPlaceWithoutEvidence) {
  const Instance object = ring({100, 120}, 40);
  const cv::Mat blank(scene_size, CV_8UC1, cv::Scalar(128));
  MaskPropagator propagator;
  const Segmentation result = result_of(frame_of(blank, 0), {object});
  for (int i = 0; i <= 3; ++i) {
    const auto moved = propagator.propagate(frame_of(blank, i), result);
    EXPECT_TRUE(same(painted(*moved), painted(object)));
    EXPECT_EQ(moved->instances.at(0).box, object.box);
  }
}

TEST(MaskPropagator, MovesOlderResultsFromTheStartOfTheHistory) {
  const Pan pan({4, 0});
  MaskPropagator propagator({10});
  const Instance object = ring({100, 120}, 40);
  const Segmentation result = result_of(pan.frame(0), {object});
  for (int i = 0; i < 34; ++i) propagator.propagate(pan.frame(i), std::nullopt);
  const auto moved = propagator.propagate(pan.frame(34), result);
  // The history's frames are 5 to 34.
  EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin + 29 * cv::Point(4, 0));
}

TEST(MaskPropagator, MatchesResultsByTimeOrFrameId) {
  const Pan pan({4, 0});
  const Instance object = ring({100, 120}, 40);
  for (const bool has_time : {true, false}) {
    MaskPropagator propagator;
    Segmentation result = result_of(pan.frame(1), {object});
    for (int i = 0; i < 5; ++i) {
      FrameView frame = pan.frame(i);
      if (has_time) frame.id = 0;
      propagator.propagate(frame, std::nullopt);
    }
    FrameView frame = pan.frame(5);
    if (has_time) {
      frame.id = result.frame_id = 0;
    } else {
      result.timestamp_s = 0;  // not set
    }
    const auto moved = propagator.propagate(frame, result);
    ASSERT_TRUE(moved);
    EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin + cv::Point(16, 0));
  }
}

TEST(MaskPropagator, IgnoresOutdatedAndFutureResults) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  const Instance object = ring({100, 120}, 40), other = ring({200, 120}, 40);
  propagator.propagate(frame_of(image, 0), std::nullopt);
  propagator.propagate(frame_of(image, 1), result_of(frame_of(image, 1), {object}));
  for (const int of : {0, 9}) {
    const auto moved = propagator.propagate(frame_of(image, 2 + of),
                                            result_of(frame_of(image, of == 0 ? 0 : 20), {other}));
    ASSERT_EQ(moved->instances.size(), 1U);
    EXPECT_EQ(moved->instances[0].mask_origin, object.mask_origin);
  }
  Segmentation second = result_of(frame_of(image, 1), {other});
  second.frame_id = 7;  // another one of the same time
  const auto moved = propagator.propagate(frame_of(image, 12), second);
  EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin);
}

/// All times are multiples of 1/8 s, so that ages are exact.
TEST(MaskPropagator, MasksMayBeAsOldAsTheLimit) {
  const cv::Mat image = texture(scene_size, 1);
  const auto frame_at = [&](double timestamp_s) {
    FrameView frame = frame_of(image, static_cast<int>(timestamp_s * 8));
    frame.timestamp_s = timestamp_s;
    return frame;
  };
  const Segmentation result = result_of(frame_at(4), {ring({100, 120}, 40)});
  const MaskPropagatorOptions options{0.5};
  for (const bool is_late : {false, true}) {
    // The limit holds for masks that come late as for masks that are kept.
    MaskPropagator propagator(options);
    propagator.propagate(frame_at(4), is_late ? std::nullopt : std::optional(result));
    const auto oldest = propagator.propagate(frame_at(4.5), result);
    ASSERT_TRUE(oldest) << is_late;
    EXPECT_EQ(oldest->instances.size(), 1U);
    EXPECT_FALSE(propagator.propagate(frame_at(4.625), std::nullopt)) << is_late;
  }
  MaskPropagator propagator(options);
  propagator.propagate(frame_at(4), std::nullopt);
  EXPECT_FALSE(propagator.propagate(frame_at(4.625), result));
}

}  // namespace
}  // namespace dynfilter::testing
