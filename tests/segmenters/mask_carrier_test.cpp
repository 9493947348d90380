// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_carrier.hpp"

#include "lab/scenes/scene_levels.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "propagator_scene.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

constexpr float wall_m = 4;

/// A person of patches who walks to the right before a wall, 3 px a frame.
struct Walk {
  float person_m = 1.5F;
  float nearer_m = 0;      // a frame
  int leaves_at = 10'000;  // the frame from which on nobody is there

  cv::Point shift(int i) const { return {3 * i, 0}; }

  FrameView frame(int i) const {
    const bool is_there = i < leaves_at;
    FrameView frame = frame_of(is_there ? image_with({{person, shift(i)}}) : image_with({}), i);
    cv::Mat1f depth(scene_size, wall_m);
    if (is_there) depth(person.place + shift(i)) = person_m - static_cast<float>(i) * nearer_m;
    frame.depth = depth;
    return frame;
  }

  Segmentation masks(int i) const { return result_of(frame(i), {person.instance(shift(i))}); }

  Patch person{{60, 60, 50, 120}, 3};
};

/// Lets a network find the person in frames 0 to 3 and miss him from then on. Returns how many
/// masks there are in a frame.
std::size_t masks_when_missed(const Walk& walk, int frame, MaskCarrier carrier = MaskCarrier()) {
  std::size_t masks = 0;
  for (int i = 0; i <= frame; ++i) {
    const FrameView now = walk.frame(i);
    masks = carrier.carry(now, i < 4 ? walk.masks(i) : result_of(now, {})).instances.size();
  }
  return masks;
}

TEST(MaskCarrier, CarriesWhoIsMissedForASecondAndNotLonger) {
  const Walk walk;
  MaskCarrier carrier;
  for (int i = 0; i < 40; ++i) {
    const FrameView now = walk.frame(i);
    const Segmentation found = i < 4 ? walk.masks(i) : result_of(now, {});
    const Segmentation masks = carrier.carry(now, found);
    ASSERT_EQ(masks.instances.size(), i <= 33 ? 1U : 0U) << i;
    EXPECT_EQ(masks.timestamp_s, now.timestamp_s);
    if (i > 33) continue;
    EXPECT_GT(iou(painted(masks), painted(walk.masks(i))), i < 10 ? 0.9 : 0.6) << i;
    EXPECT_FALSE(masks.instances[0].track_id);
  }
}

TEST(MaskCarrier, FollowsWhoComesNearer) { EXPECT_EQ(masks_when_missed({2.5F, 0.04F}, 30), 1U); }

TEST(MaskCarrier, DropsWhoHasLeft) {
  Walk walk;
  walk.leaves_at = 4;
  EXPECT_EQ(masks_when_missed(walk, 4), 0U);
  walk.leaves_at = 10;
  EXPECT_EQ(masks_when_missed(walk, 9), 1U);
  EXPECT_EQ(masks_when_missed(walk, 10), 0U);
  EXPECT_EQ(masks_when_missed(walk, 12), 0U);
}

TEST(MaskCarrier, CarriesDynamicClassesAlone) {
  EXPECT_EQ(masks_when_missed({}, 6, MaskCarrier({2})), 0U);
  Walk walk;
  walk.person.class_id = 2;
  EXPECT_EQ(masks_when_missed(walk, 6, MaskCarrier({0, 2})), 1U);
}

TEST(MaskCarrier, CarriesNobodyTwice) {
  const Walk walk;
  MaskCarrier carrier;
  const FrameView first = walk.frame(0), later = walk.frame(20);  // boxes do not meet
  carrier.carry(first, walk.masks(0));
  Segmentation chair = walk.masks(1);
  chair.instances[0].class_id = 56;
  EXPECT_EQ(carrier.carry(walk.frame(1), chair).instances.size(), 1U);
  carrier.reset();
  carrier.carry(first, walk.masks(0));
  Segmentation half = walk.masks(1);  // the other half would look missed
  half.instances[0].mask = half.instances[0].mask.clone();
  half.instances[0].mask.rowRange(60, 120).setTo(0);
  EXPECT_EQ(carrier.carry(walk.frame(1), half).instances.size(), 1U);
  carrier.reset();
  carrier.carry(first, walk.masks(0));
  EXPECT_EQ(carrier.carry(later, walk.masks(20)).instances.size(), 1U);
}

TEST(MaskCarrier, NeedsDepthAndFreshMasks) {
  const Walk walk;
  MaskCarrier carrier;
  carrier.carry(walk.frame(0), walk.masks(0));
  const FrameView now = walk.frame(1);
  Segmentation late = result_of(walk.frame(0), {});
  late.timestamp_s = now.timestamp_s - 0.033;
  EXPECT_TRUE(carrier.carry(now, late).instances.empty());
  carrier.carry(walk.frame(2), walk.masks(2));
  FrameView flat = walk.frame(3);
  flat.depth.release();
  EXPECT_TRUE(carrier.carry(flat, result_of(flat, {})).instances.empty());
  flat.timestamp_s = NAN;
  expect_misuse([&] { carrier.carry(flat, result_of(now, {})); }, "MaskCarrier");
}

/// A network with exact masks misses each rendered person for 1 to 20 frames, and finds them for as
/// long in between.
TEST(MaskCarrier, CoversRenderedPersonsWhoAreMissed) {
  SyntheticSceneOptions options = scene_level("cross", 7);
  options.image_size = {320, 240};
  options.frames = 90;
  options.mask_faults = MaskFaults::none;
  const SyntheticScene scene(options);
  MaskCarrier carrier;
  double missed = 0, covered = 0, ghosts = 0;
  for (int i = 0, gap = 1, next = 3; i < options.frames; ++i) {
    const SyntheticFrame frame = scene.render(i);
    const bool is_missed = i >= next;
    if (is_missed && i - next == gap - 1) next = i + 1 + gap, gap += 4;
    Segmentation found = frame.true_segmentation;
    if (is_missed) found.instances.clear();
    const cv::Mat truth = painted(frame.true_segmentation);
    cv::Mat near_truth;
    cv::dilate(truth, near_truth, cv::Mat::ones(7, 7, CV_8UC1));
    const cv::Mat masks = painted(carrier.carry(frame.frame, found));
    if (!is_missed) continue;
    missed += cv::countNonZero(truth);
    covered += cv::countNonZero(masks & truth);
    ghosts += cv::countNonZero(masks & ~near_truth);
  }
  EXPECT_GT(covered, 0.6 * missed);
  EXPECT_LT(ghosts, 0.1 * missed);
}

}  // namespace
}  // namespace dynfilter::testing
