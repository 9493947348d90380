// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A long run of what remembers earlier frames: MaskPropagator moves late masks, MotionFilter
// filters by them. A short camera path is walked to and fro. Memory stays flat, and after each
// restart, which a time that goes back causes, the answers are those of the first time.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "support/motion_rig.hpp"
#include "support/soak.hpp"

namespace dynfilter::testing {
namespace {

/// Shot that is seen in the frame of this number, on the way to the last one and back.
const Shot& shot_of(long number) {
  const std::vector<Shot>& all = shots(1.2);
  const long last = static_cast<long>(all.size()) - 1;
  const long step = number % (2 * last);
  return all[static_cast<std::size_t>(step <= last ? step : 2 * last - step)];
}

FrameView walked_frame(long number) {
  FrameView frame = shot_of(number).rendered.frame;
  frame.id = static_cast<std::uint64_t>(number);
  frame.timestamp_s = static_cast<double>(number) / 30;
  return frame;
}

/// Masks that are known in the frame of this number: those of a frame five to eight before it.
std::optional<Segmentation> newest_masks(long number) {
  const long masked = (number - 5) / 4 * 4;
  if (number < 5) return {};
  Segmentation masks = shot_of(masked).rendered.true_segmentation;
  const FrameView frame = walked_frame(masked);
  masks.frame_id = frame.id;
  masks.timestamp_s = frame.timestamp_s;
  return masks;
}

TEST(SlowSoakMotion, MovedMasksAndMotionNeedNoMoreMemoryAndKeepTheirLabels) {
  constexpr long wanted = 600;
  constexpr long frames_of_a_life = 60;
  FlatMemory memory(static_cast<double>(wanted));
  MaskPropagator propagator;
  MotionState state;
  const MotionFilter filter(camera(), state);
  FeatureLabels labels;
  Workspace workspace;
  std::vector<FeatureLabels> first;
  long frames = 0, moved = 0, judged = 0;
  for (; frames < wanted; ++frames) {
    const long number = frames % frames_of_a_life;
    const FrameView frame = walked_frame(number);
    const std::optional<Segmentation> masks = propagator.propagate(frame, newest_masks(number));
    ASSERT_EQ(propagator.statistics().restarted, number == 0 && frames > 0);
    for (const InstancePropagation& instance : propagator.statistics().instances) {
      moved += instance.by_flow > 0 ? 1 : 0;
    }
    filter.apply(frame, masks, shot_of(number).keypoints, labels, workspace);
    judged += labels.statistics().motion.outcome == MotionOutcome::applied ? 1 : 0;
    if (frames < frames_of_a_life) {
      first.push_back(labels);
    } else {
      ASSERT_TRUE(are_equal(labels, first[static_cast<std::size_t>(number)]))
          << "frame " << number << " again, after " << frames;
    }
    memory.at(static_cast<double>(frames));
  }
  EXPECT_GT(moved, frames / 2) << "otherwise the test shows nothing";
  EXPECT_GT(judged, frames / 2) << "otherwise the test shows nothing";
}

}  // namespace
}  // namespace dynfilter::testing
