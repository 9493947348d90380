// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tracks from result to result, and what restarts them.

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/propagator_scene.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

// --- Tracks --------------------------------------------------------------------------------------

TEST(MaskPropagator, BridgesWhatThreeLateResultsMissThenDropsIt) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  const Instance object = ring({80, 120}, 40), other = ring({230, 120}, 40);
  const auto give = [&](int i, const std::vector<Instance>& instances) {
    propagator.propagate(frame_of(image, 2 * i), std::nullopt);
    return propagator.propagate(frame_of(image, 2 * i + 1),
                                result_of(frame_of(image, 2 * i), instances));
  };
  ASSERT_EQ(give(0, {object, other})->instances.size(), 2U);
  for (int i = 1; i <= 3; ++i) {
    const auto moved = give(i, {other});
    ASSERT_EQ(moved->instances.size(), 2U) << i;
    EXPECT_EQ(moved->instances[0].track_id, 1);  // instances of the result come first
    EXPECT_EQ(moved->instances[1].track_id, 0);
    EXPECT_TRUE(same(painted(moved->instances[1]), painted(object)));
  }
  EXPECT_EQ(give(4, {other, object})->instances.at(1).track_id, 0) << "it is found again";
  for (int i = 5; i <= 7; ++i) EXPECT_EQ(give(i, {other})->instances.size(), 2U);
  EXPECT_EQ(give(8, {other})->instances.size(), 1U);
  EXPECT_EQ(give(9, {other, object})->instances.at(1).track_id, 2) << "it is a new track";
}

// From the second result to the third, the boxes of `found` overlap those of `known`.
TEST(MaskPropagator, MatchesBoxesOfOneClassByTheirLargestOverlap) {
  const cv::Mat blank(scene_size, CV_8UC1, cv::Scalar(128));
  const auto ids = [&](const std::vector<Instance>& known, const std::vector<Instance>& found) {
    MaskPropagator propagator;
    propagator.propagate(frame_of(blank, 0), result_of(frame_of(blank, 0), known));
    std::vector<int> all;
    const auto moved =
        propagator.propagate(frame_of(blank, 1), result_of(frame_of(blank, 1), found));
    for (const Instance& instance : moved->instances) all.push_back(*instance.track_id);
    return all;
  };
  const auto box = [](int x, int width, int class_id = 0) {
    return Instance::from_box({x, 40, width, 40}, class_id);
  };
  using Ids = std::vector<int>;
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 20)}), Ids{0}) << "a quarter suffices";
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 19)}), Ids{1});
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 80, 1)}), Ids{1}) << "another class";
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 30), box(40, 60)}), (Ids{1, 0}));
  EXPECT_EQ(ids({box(40, 40), box(40, 80)}, {box(40, 80)}), Ids{1});
  EXPECT_EQ(ids({box(40, 80), box(40, 80)}, {box(40, 80), box(40, 80)}), (Ids{0, 1}));
}

TEST(MaskPropagator, DropsAtOnceWhatAResultOfTheFrameItselfMisses) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  const Instance object = ring({80, 120}, 40), other = ring({230, 120}, 40);
  propagator.propagate(frame_of(image, 0), result_of(frame_of(image, 0), {object, other}));
  const auto left =
      propagator.propagate(frame_of(image, 1), result_of(frame_of(image, 1), {other}));
  ASSERT_EQ(left->instances.size(), 1U);
  EXPECT_EQ(left->instances[0].track_id, 1);
}

TEST(MaskPropagator, TrackIdsSurviveCrossingObjects) {
  const Patch one{{20, 60, 60, 90}, 5}, two{{240, 80, 60, 90}, 6};
  MaskPropagator propagator;
  std::optional<Segmentation> newest;
  for (int i = 0; i <= 27; ++i) {
    const cv::Point right(8 * i, 0), left(-8 * i, 0);
    const FrameView frame = frame_of(image_with({{two, left}, {one, right}}), i);
    // The order of the instances changes.
    const bool turned = i % 2 == 1;
    if (i % 3 == 0) {
      newest = turned ? result_of(frame, {two.instance(left), one.instance(right)})
                      : result_of(frame, {one.instance(right), two.instance(left)});
    }
    const auto moved = propagator.propagate(frame, newest);
    ASSERT_EQ(moved->instances.size(), 2U) << i;
    for (const Instance& instance : moved->instances) {
      const Instance want = instance.track_id == 0 ? one.instance(right) : two.instance(left);
      EXPECT_GT((instance.box & want.box).area(), 0.5 * want.box.area()) << i;
    }
  }
}

TEST(MaskPropagator, DropsObjectsThatLeaveTheImage) {
  const Patch patch{{220, 70, 70, 100}, 5};
  MaskPropagator propagator;
  std::optional<Segmentation> newest;
  std::size_t frames_seen = 0;
  for (int i = 0; i <= 22; ++i) {
    const cv::Point shift(8 * i, 0);
    const FrameView frame = frame_of(image_with({{patch, shift}}), i);
    if (i == 0) newest = result_of(frame, {patch.instance({})});
    const auto moved = propagator.propagate(frame, newest);
    ASSERT_TRUE(moved);
    frames_seen += moved->instances.size();
    for (const Instance& instance : moved->instances) {
      EXPECT_EQ(instance.box & cv::Rect({}, scene_size), instance.box) << "clipped";
      const cv::Rect place(instance.mask_origin, instance.mask.size());
      EXPECT_EQ(place & cv::Rect({}, scene_size), place);
    }
  }
  EXPECT_GE(frames_seen, 11U);  // it touches the image up to frame 12
  EXPECT_LE(frames_seen, 20U);
}

TEST(MaskPropagator, KeepsTrackIdsOfTheSegmenter) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  Instance object = ring({80, 120}, 40), other = ring({230, 120}, 40);
  object.track_id = 7;
  propagator.propagate(frame_of(image, 0), result_of(frame_of(image, 0), {object}));
  // Moves it to where, by the box, another object would match it.
  object.mask_origin.x += 150;
  object.box.x += 150;
  other.mask_origin.x -= 150;
  other.box.x -= 150;
  const auto moved =
      propagator.propagate(frame_of(image, 1), result_of(frame_of(image, 1), {other, object}));
  ASSERT_EQ(moved->instances.size(), 2U);
  EXPECT_EQ(moved->instances[0].track_id, 8);
  EXPECT_EQ(moved->instances[1].track_id, 7);

  object.track_id = std::numeric_limits<int>::max();
  const auto next =
      propagator.propagate(frame_of(image, 2), result_of(frame_of(image, 2), {object}));
  EXPECT_EQ(next->instances.at(0).track_id, std::numeric_limits<int>::max());
}

TEST(MaskPropagator, MakesRoomForAnIdThatASegmenterBringsLate) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  const Instance early = ring({80, 120}, 40);
  Instance late = ring({230, 120}, 40);
  late.track_id = 0;  // as of a tracker that numbers only what it has seen for some frames
  const auto ids = [&](int frame, const std::vector<Instance>& instances) {
    std::vector<int> all;
    const FrameView view = frame_of(image, frame);
    const auto moved = propagator.propagate(view, result_of(view, instances));
    for (const Instance& instance : moved->instances) all.push_back(*instance.track_id);
    return all;
  };
  EXPECT_EQ(ids(0, {early}), std::vector<int>({0}));
  EXPECT_EQ(ids(1, {early, late}), std::vector<int>({1, 0}));
}

// --- Restart -------------------------------------------------------------------------------------

TEST(MaskPropagator, TimeGoingBackOrAnotherSizeRestarts) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  const auto result = [&](int i) { return result_of(frame_of(image, i), {ring({100, 120}, 40)}); };
  EXPECT_TRUE(propagator.propagate(frame_of(image, 4), result(4)));
  EXPECT_FALSE(propagator.propagate(frame_of(image, 4), std::nullopt))
      << "the time has not advanced";
  EXPECT_FALSE(propagator.propagate(frame_of(image, 2), std::nullopt));
  const auto moved = propagator.propagate(frame_of(image, 3), result(3));
  EXPECT_EQ(moved->instances.at(0).track_id, 1) << "ids are never reused";
  EXPECT_FALSE(propagator.propagate(frame_of(texture(scene_size * 2, 1), 5), std::nullopt));
}

}  // namespace
}  // namespace dynfilter::testing
