// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Motion, age and time of propagated masks.

#include "dynfilter/segmenters/mask_propagator.hpp"

#include "segmenters/propagator_scene.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using TrackIds = std::vector<int>;

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
      result.timestamp_s.reset();
    }
    const auto moved = propagator.propagate(frame, result);
    ASSERT_TRUE(moved);
    EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin + cv::Point(16, 0));
  }
  MaskPropagator propagator;
  for (const int i : {0, 1}) {  // neither numbers nor times
    FrameView frame = pan.frame(i);
    frame.id = 0;
    const Segmentation own{0, {}, scene_size, {ring({100 + 50 * i, 120}, 40)}};
    EXPECT_EQ(propagator.propagate(frame, own).value().instances.at(0).mask_origin.x, 60 + 50 * i);
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
    track_ids(propagator, blank, 0, known);
    return track_ids(propagator, blank, 1, found);
  };
  const auto box = [](int x, int width, int class_id = 0) {
    return Instance::from_box({x, 40, width, 40}, class_id);
  };
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 20)}), TrackIds{0}) << "a quarter suffices";
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 19)}), TrackIds{1});
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 80, 1)}), TrackIds{1}) << "another class";
  EXPECT_EQ(ids({box(40, 80)}, {box(40, 30), box(40, 60)}), (TrackIds{1, 0}));
  EXPECT_EQ(ids({box(40, 40), box(40, 80)}, {box(40, 80)}), TrackIds{1});
  EXPECT_EQ(ids({box(40, 80), box(40, 80)}, {box(40, 80), box(40, 80)}), (TrackIds{0, 1}));
}

TEST(MaskPropagator, MatchesMasksWithoutABox) {
  const Pan pan({2, 0});
  Instance object = ring({160, 120}, 45);
  object.box = {};
  MaskPropagator propagator;
  propagator.propagate(pan.frame(0), std::nullopt);
  for (int i = 1; i < 5; ++i) {
    const auto moved = propagator.propagate(pan.frame(i), result_of(pan.frame(i - 1), {object}));
    ASSERT_EQ(moved->instances.size(), 1U) << i;
    EXPECT_EQ(moved->instances[0].track_id, 0);
    EXPECT_TRUE(moved->instances[0].box.empty());
    object.mask_origin.x += 2;
  }
}

TEST(MaskPropagator, DropsAtOnceWhatAResultOfTheFrameItselfMisses) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  const Instance object = ring({80, 120}, 40), other = ring({230, 120}, 40);
  track_ids(propagator, image, 0, {object, other});
  EXPECT_EQ(track_ids(propagator, image, 1, {other}), TrackIds{1});
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
  track_ids(propagator, image, 0, {object});
  // Moves it to where, by the box, another object would match it.
  object.mask_origin.x += 150;
  object.box.x += 150;
  other.mask_origin.x -= 150;
  other.box.x -= 150;
  EXPECT_EQ(track_ids(propagator, image, 1, {other, object}), (TrackIds{8, 7}));
  object.track_id = std::numeric_limits<int>::max();
  EXPECT_EQ(track_ids(propagator, image, 2, {object}), TrackIds{*object.track_id});
}

TEST(MaskPropagator, MakesRoomForAnIdThatASegmenterBringsLate) {
  const cv::Mat image = texture(scene_size, 1);
  MaskPropagator propagator;
  const Instance early = ring({80, 120}, 40);
  Instance late = ring({230, 120}, 40);
  late.track_id = 0;  // as of a tracker that numbers only what it has seen for some frames
  EXPECT_EQ(track_ids(propagator, image, 0, {early}), TrackIds{0});
  EXPECT_EQ(track_ids(propagator, image, 1, {early, late}), (TrackIds{1, 0}));
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
