// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.hpp"
#include "support/scene_images.hpp"

namespace dynfilter {
namespace {

using testing::expect_error;
using testing::painted;
using testing::pixel_hash;
using testing::same;

const cv::Size size(320, 240);

/// Texture of blotches of a few pixels in all greys.
cv::Mat1b texture(const cv::Size& of, std::uint64_t seed) {
  cv::Mat noise(of, CV_32FC1);
  cv::RNG random(seed);
  random.fill(noise, cv::RNG::UNIFORM, 0.0, 1.0);
  cv::GaussianBlur(noise, noise, cv::Size(), 1.5);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  noise.convertTo(noise, CV_8U);
  return noise;
}

FrameView frame_of(const cv::Mat& image, int index) {
  FrameView frame;
  frame.id = static_cast<std::uint64_t>(100 + index);
  frame.timestamp_s = 5.0 + index / 30.0;
  frame.image = image;
  return frame;
}

Segmentation result_of(const FrameView& frame, std::vector<Instance> instances,
                       const cv::Size& image = size) {
  return {frame.id, frame.timestamp_s, image, std::move(instances)};
}

/// Disc-shaped mask with a hole, whose non-zero values differ.
Instance ring(cv::Point centre, int radius) {
  cv::Mat1b mask(2 * radius + 1, 2 * radius + 1, std::uint8_t{0});
  cv::circle(mask, {radius, radius}, radius, 255, cv::FILLED);
  cv::circle(mask, {radius, radius}, radius / 4, 0, cv::FILLED);
  mask(radius, radius / 2) = 7;
  const cv::Point origin = centre - cv::Point(radius, radius);
  Instance instance = Instance::from_box_mask(mask, {origin, mask.size()}, 0, 0.75F);
  instance.box = {origin.x - 3, origin.y - 2, mask.cols + 6, mask.rows + 4};
  return instance;
}

/// Textured rectangle, wholly masked.
struct Patch {
  cv::Rect place;
  std::uint64_t seed;
  int class_id = 0;

  void paint(cv::Mat1b& image, cv::Point shift) const {
    const cv::Rect at = place + shift, seen = at & cv::Rect({}, image.size());
    if (seen.empty()) return;
    texture(place.size(), seed)(seen - at.tl()).copyTo(image(seen));
  }

  Instance instance(cv::Point shift) const {
    const cv::Rect at = (place + shift) & cv::Rect({}, size);
    return Instance::from_box_mask(cv::Mat(at.size(), CV_8UC1, cv::Scalar(255)), at, class_id);
  }
};

cv::Mat1b image_with(const std::vector<std::pair<Patch, cv::Point>>& patches) {
  cv::Mat1b image = texture(size, 1);
  for (const auto& [patch, shift] : patches) patch.paint(image, shift);
  return image;
}

double iou(const cv::Mat& a, const cv::Mat& b) {
  return double{1} * cv::countNonZero(a & b) / cv::countNonZero(a | b);
}

cv::Mat1b painted(const Instance& instance) {
  return testing::painted(Segmentation{0, 0, size, {instance}});
}

/// Images of a camera that pans over a wide texture.
class Pan {
 public:
  explicit Pan(cv::Point step, cv::Size image = size)
      : step_(step), image_(image), wide_(texture(image * 3, 7)) {}

  FrameView frame(int index) const {
    const cv::Rect window(cv::Point(image_) - index * step_, image_);
    return frame_of(wide_(window), index);
  }

 private:
  cv::Point step_;
  cv::Size image_;
  cv::Mat1b wide_;
};

// --- Motion that is known exactly ----------------------------------------------------------------

TEST(MaskPropagator, MasksAreUnchangedWithoutMotion) {
  const Instance object = ring({150, 120}, 50);
  const cv::Mat image = texture(size, 3);
  MaskPropagator propagator;
  std::optional<Segmentation> newest = result_of(frame_of(image, 0), {object});
  for (int i = 0; i < 8; ++i) {
    const auto moved = propagator.propagate(frame_of(image, i), newest);
    ASSERT_TRUE(moved);
    ASSERT_EQ(moved->instances.size(), 1U);
    EXPECT_TRUE(same(painted(moved->instances[0]), painted(object))) << i;
    EXPECT_EQ(moved->instances[0].box, object.box);
    EXPECT_EQ(moved->instances[0].class_id, 0);
    EXPECT_EQ(moved->instances[0].score, 0.75F);
    const InstancePropagation& done = propagator.statistics().instances.at(0);
    EXPECT_EQ(done.by_flow, static_cast<std::size_t>(i));
    EXPECT_EQ(done.by_velocity + done.left + done.missed, 0U);
    EXPECT_EQ(done.points > 20, i > 0);
    EXPECT_NEAR(done.age_s, i / 30.0, 1e-9);
  }
}

TEST(MaskPropagator, MovesByWholePixelsExactly) {
  for (const cv::Point step : {cv::Point(4, 0), {-3, 2}, {0, -5}, {7, 7}}) {
    for (const cv::Size image :
         {size, cv::Size(640, 480)}) {  // the propagator downscales the latter
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
  EXPECT_EQ(propagator.statistics().instances.at(0).by_flow, 6U);
  EXPECT_TRUE(propagator.statistics().took_result);
  EXPECT_FALSE(propagator.statistics().unknown_start);
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
    EXPECT_GT(iou(painted(*moved), painted(want)), 0.95) << i;
    EXPECT_LE(cv::norm(moved->instances.at(0).box.tl() - want.box.tl()), 5) << i;
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

TEST(MaskPropagator, GrowsWithAnApproachingObject) {
  const cv::Mat1b canvas = texture(size, 9);
  const Instance object = ring({160, 120}, 45);
  const auto zoomed = [&](const cv::Mat& image, double factor, int interpolation) {
    const cv::Mat zoom = cv::getRotationMatrix2D({160, 120}, 0, factor);
    cv::Mat result;
    cv::warpAffine(image, result, zoom, size, interpolation);
    return result;
  };
  MaskPropagator propagator;
  const Segmentation newest = result_of(frame_of(canvas, 0), {object});
  std::optional<Segmentation> moved;
  for (int i = 0; i <= 8; ++i) {
    moved = propagator.propagate(frame_of(zoomed(canvas, std::pow(1.03, i), cv::INTER_CUBIC), i),
                                 newest);
  }
  const cv::Mat want = zoomed(painted(object) != 0, std::pow(1.03, 8), cv::INTER_NEAREST);
  EXPECT_LT(iou(painted(object), want), 0.7);
  EXPECT_GT(iou(painted(*moved), want), 0.88);
  EXPECT_NEAR(moved->instances.at(0).box.width, 91 * std::pow(1.03, 8) + 6, 5);
}

TEST(MaskPropagator, MovesBoxesWithoutMasks) {
  const Patch patch{{60, 70, 80, 100}, 5};
  MaskPropagator propagator;
  std::optional<Segmentation> newest;
  for (int i = 0; i <= 6; ++i) {
    const cv::Point shift(6 * i, 0);
    const FrameView frame = frame_of(image_with({{patch, shift}}), i);
    if (i == 0) newest = result_of(frame, {Instance::from_box({60, 70, 80, 100})});
    const auto moved = propagator.propagate(frame, newest);
    EXPECT_TRUE(moved->instances.at(0).mask.empty());
    EXPECT_EQ(moved->instances.at(0).box, cv::Rect(60 + 6 * i, 70, 80, 100));
  }
}

// --- Results of the frame itself, age and time ---------------------------------------------------

TEST(MaskPropagator, ReturnsAResultOfTheFrameItselfUnchanged) {
  Instance object = ring({5, 120}, 50);  // partly outside
  object.box = {-70, 60, 120, 130};
  const Segmentation result = result_of(frame_of(texture(size, 1), 0), {object});
  MaskPropagator propagator;
  const auto moved = propagator.propagate(frame_of(texture(size, 1), 0), result);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->instances.at(0).box, object.box);
  EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin);
  EXPECT_TRUE(same(moved->instances.at(0).mask, object.mask));
  EXPECT_EQ(moved->instances.at(0).track_id, 0);
}

TEST(MaskPropagator, DistinguishesEmptyResultsFromNoResult) {
  MaskPropagatorOptions options;
  options.max_age_s = 0.11;
  MaskPropagator propagator(options);
  const cv::Mat image = texture(size, 1);
  EXPECT_FALSE(propagator.propagate(frame_of(image, 0), std::nullopt));
  const Segmentation nobody = result_of(frame_of(image, 1), {});
  for (int i = 1; i <= 4; ++i) {
    const auto moved = propagator.propagate(frame_of(image, i), nobody);
    ASSERT_TRUE(moved) << i;
    EXPECT_TRUE(moved->instances.empty());
    EXPECT_EQ(moved->image_size, size);
  }
  EXPECT_FALSE(propagator.propagate(frame_of(image, 5), nobody)) << "the result is too old";
}

TEST(MaskPropagator, DropsMasksThatAreTooOld) {
  MaskPropagatorOptions options;
  options.max_age_s = 0.11;
  MaskPropagator propagator(options);
  const cv::Mat image = texture(size, 1);
  const Segmentation result = result_of(frame_of(image, 0), {ring({100, 100}, 30)});
  for (int i = 0; i <= 3; ++i) EXPECT_TRUE(propagator.propagate(frame_of(image, i), result)) << i;
  EXPECT_FALSE(propagator.propagate(frame_of(image, 4), std::nullopt));
  EXPECT_EQ(propagator.statistics().given_up, 1U);
}

TEST(MaskPropagator, TimestampIncludesAShareOfTheAge) {
  const cv::Mat image = texture(size, 1);
  for (const double share : {0.0, 0.25, 1.0}) {
    MaskPropagatorOptions options;
    options.age_share = share;
    MaskPropagator propagator(options);
    const Segmentation result = result_of(frame_of(image, 0), {ring({100, 100}, 30)});
    propagator.propagate(frame_of(image, 0), result);
    const auto moved = propagator.propagate(frame_of(image, 4), result);
    EXPECT_EQ(moved->frame_id, 104U);
    EXPECT_NEAR(moved->timestamp_s, 5.0 + (1 - share) * 4 / 30.0, 1e-9);
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
    EXPECT_EQ(propagator.statistics().instances.at(0).by_flow, 4U);
    EXPECT_EQ(propagator.statistics().instances.at(0).by_velocity, static_cast<std::size_t>(i - 4));
  }
}

TEST(MaskPropagator, EstimatesVelocityFromTwoResults) {
  MaskPropagator propagator;
  FrameView frame = frame_of({}, 0);  // it has no image
  propagator.propagate(frame, result_of(frame, {ring({100, 100}, 30)}));
  frame = frame_of({}, 3);
  propagator.propagate(frame, result_of(frame, {ring({112, 94}, 30)}));
  const auto moved = propagator.propagate(frame_of({}, 6), std::nullopt);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->instances.at(0).mask_origin, cv::Point(124 - 30, 88 - 30));
  EXPECT_EQ(propagator.statistics().instances.at(0).by_velocity, 1U);
}

TEST(MaskPropagator, LeavesMasksInPlaceWithoutEvidence) {
  const Instance object = ring({100, 120}, 40);
  const cv::Mat blank(size, CV_8UC1, cv::Scalar(128));
  MaskPropagator propagator;
  const Segmentation result = result_of(frame_of(blank, 0), {object});
  for (int i = 0; i <= 3; ++i) {
    const auto moved = propagator.propagate(frame_of(blank, i), result);
    EXPECT_TRUE(same(painted(*moved), painted(object)));
    EXPECT_EQ(moved->instances.at(0).box, object.box);
    EXPECT_EQ(propagator.statistics().instances.at(0).left, static_cast<std::size_t>(i));
    EXPECT_EQ(propagator.statistics().tracked_points, 0U);
  }
}

TEST(MaskPropagator, MovesOlderResultsFromTheStartOfTheHistory) {
  const Pan pan({4, 0});
  MaskPropagatorOptions options;
  options.history_frames = 3;
  MaskPropagator propagator(options);
  const Instance object = ring({100, 120}, 40);
  const Segmentation result = result_of(pan.frame(0), {object});
  for (int i = 0; i < 6; ++i) propagator.propagate(pan.frame(i), std::nullopt);
  const auto moved = propagator.propagate(pan.frame(6), result);
  EXPECT_TRUE(propagator.statistics().unknown_start);
  // The history's frames are 4, 5 and 6.
  EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin + cv::Point(8, 0));
  EXPECT_EQ(propagator.statistics().instances.at(0).by_flow, 2U);
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
    EXPECT_FALSE(propagator.statistics().unknown_start);
    EXPECT_EQ(moved->instances.at(0).mask_origin, object.mask_origin + cv::Point(16, 0));
    EXPECT_NEAR(propagator.statistics().instances.at(0).age_s, 4 / 30.0, 1e-9);
  }
}

TEST(MaskPropagator, IgnoresOutdatedAndFutureResults) {
  const cv::Mat image = texture(size, 1);
  MaskPropagator propagator;
  const Instance object = ring({100, 120}, 40), other = ring({200, 120}, 40);
  propagator.propagate(frame_of(image, 0), std::nullopt);
  propagator.propagate(frame_of(image, 1), result_of(frame_of(image, 1), {object}));
  for (const int of : {0, 9}) {
    const auto moved = propagator.propagate(frame_of(image, 2 + of),
                                            result_of(frame_of(image, of == 0 ? 0 : 20), {other}));
    EXPECT_TRUE(propagator.statistics().ignored_result);
    EXPECT_FALSE(propagator.statistics().took_result);
    ASSERT_EQ(moved->instances.size(), 1U);
    EXPECT_EQ(moved->instances[0].mask_origin, object.mask_origin);
  }
}

// --- Tracks --------------------------------------------------------------------------------------

TEST(MaskPropagator, BridgesMissedDetectionsThenDropsThem) {
  const cv::Mat image = texture(size, 1);
  MaskPropagatorOptions options;
  options.max_missed = 2;
  MaskPropagator propagator(options);
  const Instance object = ring({80, 120}, 40), other = ring({230, 120}, 40);
  const auto give = [&](int i, std::vector<Instance> instances) {
    return propagator.propagate(frame_of(image, i), result_of(frame_of(image, i), instances));
  };
  ASSERT_EQ(give(0, {object, other})->instances.size(), 2U);
  for (int i = 1; i <= 2; ++i) {
    const auto moved = give(i, {other});
    ASSERT_EQ(moved->instances.size(), 2U) << i;
    EXPECT_EQ(moved->instances[0].track_id, 1);  // instances of the result come first
    EXPECT_EQ(moved->instances[1].track_id, 0);
    EXPECT_TRUE(same(painted(moved->instances[1]), painted(object)));
    EXPECT_EQ(propagator.statistics().instances.at(1).missed, static_cast<std::size_t>(i));
    EXPECT_EQ(propagator.statistics().instances.at(1).by_flow, static_cast<std::size_t>(i));
    // Passing the old result again, or none, adds no missed detection.
    propagator.propagate(FrameView{frame_of(image, i).id, 5.0 + (i + 0.5) / 30, image, {}, 0},
                         i == 1
                             ? std::optional<Segmentation>(result_of(frame_of(image, i), {other}))
                             : std::nullopt);
    EXPECT_EQ(propagator.statistics().instances.at(1).missed, static_cast<std::size_t>(i));
    EXPECT_FALSE(propagator.statistics().took_result);
    propagator.reset();
    give(0, {object, other});
    for (int k = 1; k <= i; ++k) give(k, {other});
  }
  const auto found = give(3, {other, object});
  EXPECT_EQ(found->instances.at(1).track_id, 0) << "the segmenter found it again";
  EXPECT_EQ(propagator.statistics().instances.at(1).missed, 0U);
  for (int i = 4; i <= 5; ++i) EXPECT_EQ(give(i, {other})->instances.size(), 2U);
  EXPECT_EQ(give(6, {other})->instances.size(), 1U);
  EXPECT_EQ(propagator.statistics().given_up, 1U);
  EXPECT_EQ(give(7, {other, object})->instances.at(1).track_id, 2) << "it is a new track";
}

TEST(MaskPropagator, BridgesNothingOnRequest) {
  const cv::Mat image = texture(size, 1);
  MaskPropagatorOptions options;
  options.max_missed = 0;
  MaskPropagator propagator(options);
  propagator.propagate(frame_of(image, 0), result_of(frame_of(image, 0), {ring({80, 120}, 40)}));
  const auto moved = propagator.propagate(frame_of(image, 1), result_of(frame_of(image, 1), {}));
  ASSERT_TRUE(moved);
  EXPECT_TRUE(moved->instances.empty());
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
  std::size_t gone = 0, frames_seen = 0;
  for (int i = 0; i <= 22; ++i) {
    const cv::Point shift(8 * i, 0);
    const FrameView frame = frame_of(image_with({{patch, shift}}), i);
    if (i == 0) newest = result_of(frame, {patch.instance({})});
    const auto moved = propagator.propagate(frame, newest);
    ASSERT_TRUE(moved);
    gone += propagator.statistics().left_image;
    frames_seen += moved->instances.size();
    for (const Instance& instance : moved->instances) {
      EXPECT_EQ(instance.box & cv::Rect({}, size), instance.box) << "clipped";
      const cv::Rect place(instance.mask_origin, instance.mask.size());
      EXPECT_EQ(place & cv::Rect({}, size), place);
    }
  }
  EXPECT_EQ(gone, 1U);
  EXPECT_GE(frames_seen, 11U);  // it touches the image up to frame 12
  EXPECT_LE(frames_seen, 20U);
}

TEST(MaskPropagator, ClassesAreNotMixedUp) {
  const cv::Mat image = texture(size, 1);
  MaskPropagator propagator;
  Instance object = ring({100, 120}, 40);
  propagator.propagate(frame_of(image, 0), result_of(frame_of(image, 0), {object}));
  object.class_id = 56;
  const auto moved =
      propagator.propagate(frame_of(image, 1), result_of(frame_of(image, 1), {object}));
  ASSERT_EQ(moved->instances.size(), 2U);
  EXPECT_EQ(moved->instances[0].class_id, 56);
  EXPECT_EQ(moved->instances[0].track_id, 1);
  EXPECT_EQ(moved->instances[1].class_id, 0);
  EXPECT_EQ(moved->instances[1].track_id, 0);
}

TEST(MaskPropagator, KeepsTrackIdsOfTheSegmenter) {
  const cv::Mat image = texture(size, 1);
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

// --- Restart -------------------------------------------------------------------------------------

TEST(MaskPropagator, ResetRestoresTheInitialState) {
  const Pan pan({4, 0});
  MaskPropagator propagator;
  const Segmentation result = result_of(pan.frame(0), {ring({100, 120}, 40)});
  for (int i = 0; i < 3; ++i) propagator.propagate(pan.frame(i), result);
  propagator.reset();
  EXPECT_TRUE(propagator.statistics().instances.empty());
  EXPECT_FALSE(propagator.propagate(pan.frame(0), std::nullopt));
  EXPECT_FALSE(propagator.statistics().restarted);
  const auto moved = propagator.propagate(pan.frame(1), result);
  EXPECT_EQ(moved->instances.at(0).track_id, 0);
}

TEST(MaskPropagator, TimeGoingBackRestartsAndIsReported) {
  const cv::Mat image = texture(size, 1);
  MaskPropagator propagator;
  const Segmentation result = result_of(frame_of(image, 4), {ring({100, 120}, 40)});
  EXPECT_TRUE(propagator.propagate(frame_of(image, 4), result));
  EXPECT_FALSE(propagator.propagate(frame_of(image, 4), std::nullopt))
      << "the time has not advanced";
  EXPECT_TRUE(propagator.statistics().restarted);
  EXPECT_FALSE(propagator.propagate(frame_of(image, 2), std::nullopt));
  EXPECT_TRUE(propagator.statistics().restarted);
  const auto moved = propagator.propagate(frame_of(image, 3),
                                          result_of(frame_of(image, 3), {ring({100, 120}, 40)}));
  EXPECT_FALSE(propagator.statistics().restarted);
  EXPECT_EQ(moved->instances.at(0).track_id, 1) << "ids are never reused";
}

TEST(MaskPropagator, AnotherImageSizeRestarts) {
  MaskPropagator propagator;
  const Segmentation result = result_of(frame_of(texture(size, 1), 0), {ring({100, 120}, 40)});
  EXPECT_TRUE(propagator.propagate(frame_of(texture(size, 1), 0), result));
  EXPECT_FALSE(propagator.propagate(frame_of(texture(size * 2, 1), 1), std::nullopt));
  EXPECT_TRUE(propagator.statistics().restarted);
  const FrameView frame = frame_of(texture(size * 2, 1), 2);
  const auto moved =
      propagator.propagate(frame, result_of(frame, {ring({300, 200}, 40)}, size * 2));
  EXPECT_EQ(moved->image_size, size * 2);
}

// --- Odd input -----------------------------------------------------------------------------------

TEST(MaskPropagator, AcceptsImagesOfAnySizeAndColour) {
  for (const cv::Size small : {cv::Size(1, 1), {2, 40}, {40, 2}, {17, 18}, {33, 31}, {2000, 20}}) {
    for (const int channels : {1, 3, 4}) {
      cv::Mat image = texture(small, 1);
      cv::merge(std::vector<cv::Mat>(static_cast<std::size_t>(channels), image), image);
      MaskPropagator propagator;
      const cv::Mat mask(small, CV_8UC1, cv::Scalar(1));
      const Segmentation result =
          result_of(frame_of(image, 0), {Instance::from_image_mask(mask)}, small);
      for (int i = 0; i < 3; ++i) {
        const auto moved = propagator.propagate(frame_of(image, i), result);
        ASSERT_EQ(moved->instances.size(), 1U);
        EXPECT_TRUE(same(painted(*moved), mask * 255)) << small << channels;
      }
    }
  }
}

TEST(MaskPropagator, AcceptsMasksAndBoxesAnywhere) {
  constexpr int least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  const cv::Mat image = texture(size, 1);
  MaskPropagator propagator;
  Instance away = ring({100, 120}, 40), vast = away, nothing = away, blank = away;
  away.mask_origin = {most - 3, least};
  away.box = {most - 3, least, 50, 50};
  vast.box = {least, least, most, most};
  nothing.mask.release();
  nothing.box = {};
  blank.mask = cv::Mat(80, 80, CV_8UC1, cv::Scalar(0));
  const Segmentation result = result_of(frame_of(image, 0), {away, vast, nothing, blank});
  EXPECT_EQ(propagator.propagate(frame_of(image, 0), result)->instances.size(), 4U);
  const auto moved = propagator.propagate(frame_of(image, 1), result);
  ASSERT_EQ(moved->instances.size(), 2U);  // vast and blank
  EXPECT_EQ(propagator.statistics().left_image, 2U);
  EXPECT_TRUE(same(painted(moved->instances[0]), painted(vast)));
  EXPECT_EQ(moved->instances[1].box, blank.box);
}

TEST(MaskPropagator, MovesHundredsOfInstances) {
  const Pan pan({2, 2});
  std::vector<Instance> crowd;
  for (int y = 16; y < 200; y += 9) {
    for (int x = 16; x < 280; x += 9) crowd.push_back(ring({x, y}, 8));
  }
  ASSERT_GT(crowd.size(), 500U);
  MaskPropagator propagator;
  std::optional<Segmentation> moved;
  for (int i = 0; i <= 3; ++i) {
    moved = propagator.propagate(pan.frame(i), result_of(pan.frame(i / 2 * 2), crowd));
    if (i == 1) crowd.assign(moved->instances.begin(), moved->instances.end());
    for (Instance& instance : crowd) {
      instance.track_id.reset();
      if (i == 1) {
        instance.mask_origin += cv::Point(2, 2);
        instance.box += cv::Point(2, 2);
      }
    }
  }
  ASSERT_EQ(moved->instances.size(), crowd.size());
  for (std::size_t k = 0; k < crowd.size(); ++k) {
    ASSERT_EQ(moved->instances[k].track_id, static_cast<int>(k));
    ASSERT_LE(cv::norm(moved->instances[k].mask_origin - crowd[k].mask_origin - cv::Point(2, 2)),
              1.5);
  }
}

TEST(MaskPropagator, RefusesOptionsOutOfRange) {
  const auto refuses = [](auto MaskPropagatorOptions::*member, auto value, const char* text) {
    MaskPropagatorOptions options;
    options.*member = value;
    expect_error<std::invalid_argument>([&] { MaskPropagator{options}; },
                                        std::string("MaskPropagator: got ") + text);
  };
  using Options = MaskPropagatorOptions;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuses(&Options::work_width_px, 63, "work_width_px = 63");
  refuses(&Options::point_spacing_px, 3, "point_spacing_px = 3");
  refuses(&Options::max_forward_backward_px, -0.1, "max_forward_backward_px");
  refuses(&Options::field_sigma_px, 0.5, "field_sigma_px");
  refuses(&Options::field_sigma_px, nan, "field_sigma_px");
  refuses(&Options::min_points, std::size_t{0}, "min_points = 0");
  refuses(&Options::min_iou, 1.01, "min_iou");
  refuses(&Options::max_age_s, nan, "max_age_s");
  refuses(&Options::history_frames, std::size_t{0}, "history_frames = 0");
  refuses(&Options::age_share, 1.5, "age_share");
}

TEST(MaskPropagator, RefusesBadInputWithoutChange) {
  const Pan pan({4, 0});
  const Segmentation result = result_of(pan.frame(0), {ring({100, 120}, 40)});
  MaskPropagator propagator, twin;
  for (int i = 0; i < 3; ++i) {
    propagator.propagate(pan.frame(i), result);
    twin.propagate(pan.frame(i), result);
  }
  const auto refuses = [&](const FrameView& frame, const std::optional<Segmentation>& newest,
                           const char* text) {
    expect_error<std::invalid_argument>([&] { propagator.propagate(frame, newest); }, text);
  };
  FrameView bad = pan.frame(3);
  bad.image = cv::Mat(size, CV_16UC1, cv::Scalar(1));
  refuses(bad, result, "an image of type CV_16UC1; want CV_8UC1");
  bad.image = cv::Mat(size, CV_8UC2, cv::Scalar::all(1));
  refuses(bad, result, "an image of type CV_8UC2");
  bad = pan.frame(3);
  bad.timestamp_s = std::numeric_limits<double>::infinity();
  refuses(bad, result, "timestamp_s");
  Segmentation wrong = result_of(pan.frame(2), {ring({100, 120}, 40)}, {640, 480});
  refuses(pan.frame(3), wrong, "masks of an image of 640x480; want those of the frames, 320x240");
  wrong = result_of(pan.frame(2), {ring({100, 120}, 40)});
  wrong.instances[0].score = 2;
  refuses(pan.frame(3), wrong, "score 2");
  const auto moved = propagator.propagate(pan.frame(3), result),
             want = twin.propagate(pan.frame(3), result);
  EXPECT_TRUE(same(painted(*moved), painted(*want)));
  EXPECT_EQ(propagator.statistics().instances.at(0).by_flow, 3U);
}

// --- Ownership of data ---------------------------------------------------------------------------

TEST(MaskPropagator, SharesNoPixelsWithTheCaller) {
  const Pan pan({4, 2});
  const auto run = [&](bool spoils) {
    MaskPropagator propagator;
    std::uint64_t hash = 0;
    std::optional<Segmentation> newest;
    for (int i = 0; i < 8; ++i) {
      FrameView frame = pan.frame(i);
      frame.image = frame.image.clone();
      if (i % 4 == 0) newest = result_of(frame, {ring({100 + 4 * i, 100 + 2 * i}, 40)});
      const cv::Mat image = frame.image.clone(), mask = newest->instances[0].mask.clone();
      auto moved = propagator.propagate(frame, newest);
      EXPECT_TRUE(same(frame.image, image));
      EXPECT_TRUE(same(newest->instances[0].mask, mask));
      hash = pixel_hash(painted(*moved), hash);
      if (!spoils) continue;
      frame.image.setTo(0);
      moved->instances[0].mask.setTo(0);
      newest->instances[0].mask = cv::Mat(mask.size(), CV_8UC1, cv::Scalar(0));
    }
    return hash;
  };
  EXPECT_EQ(run(false), run(true));
}

TEST(MaskPropagator, CallerMayOverwriteItsMasks) {
  const Pan pan({4, 2});
  const Segmentation result = result_of(pan.frame(0), {ring({100, 100}, 40)});
  const cv::Mat1b before = painted(result);
  MaskPropagator propagator;
  propagator.propagate(pan.frame(0), result);
  cv::Mat(result.instances[0].mask).setTo(0);
  const auto moved = propagator.propagate(pan.frame(1), std::nullopt);
  EXPECT_EQ(cv::countNonZero(painted(*moved)), cv::countNonZero(before));
}

TEST(MaskPropagator, TwoPropagatorsShareNothing) {
  const Pan pan({4, 2}), elsewhere({-6, 1});
  const auto step = [](MaskPropagator& propagator, const Pan& film, int i) {
    const Segmentation result = result_of(film.frame(i / 3 * 3), {ring({150, 100}, 40)});
    return pixel_hash(painted(*propagator.propagate(film.frame(i), result)));
  };
  std::vector<std::uint64_t> alone, interleaved;
  MaskPropagator first, second, other;
  for (int i = 0; i < 9; ++i) alone.push_back(step(first, pan, i));
  const int threads = cv::getNumThreads();
  cv::setNumThreads(threads == 1 ? 4 : 1);
  for (int i = 0; i < 9; ++i) {
    interleaved.push_back(step(second, pan, i));
    step(other, elsewhere, i);
  }
  cv::setNumThreads(threads);
  EXPECT_EQ(alone, interleaved);
}

TEST(MaskPropagator, MoveKeepsTheState) {
  const Pan pan({4, 0});
  const Segmentation result = result_of(pan.frame(0), {ring({100, 120}, 40)});
  MaskPropagator first;
  first.propagate(pan.frame(0), result);
  MaskPropagator second = std::move(first);
  const auto moved = second.propagate(pan.frame(1), std::nullopt);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->instances.at(0).box.x, result.instances[0].box.x + 4);
}

}  // namespace
}  // namespace dynfilter
