// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_state.hpp"

#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_filter.hpp"
#include "support/expect_error.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Class of a host that holds a filter and its state.
struct Tracker {
  Tracker() : filter(camera(), state) {}

  FeatureLabels see(const Shot& shot) {
    FeatureLabels labels;
    filter.apply(shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints, labels,
                 workspace);
    return labels;
  }

  MotionState state;
  MotionFilter filter;
  Workspace workspace;
};

TEST(MotionState, MayBeMovedWithTheFilterThatUsesIt) {
  Tracker resting;
  std::vector<Tracker> moved(1);
  for (std::size_t i = 0; i < 7; ++i) {
    if (i == 2) moved.reserve(moved.capacity() + 1);  // moves what it holds
    if (i == 4) {
      Tracker other;
      other = std::move(moved[0]);
      moved[0] = std::move(other);
    }
    EXPECT_TRUE(are_equal(moved[0].see(shots(0)[i]), resting.see(shots(0)[i]))) << i;
  }
  const InstanceVerdict verdict = resting.see(shots(0)[7]).statistics().instances[0].verdict;
  EXPECT_EQ(verdict, InstanceVerdict::still) << "the filters had something to remember";
}

TEST(MotionState, MayDieBeforeTheFilter) {
  std::optional<MotionState> state(std::in_place);
  const MotionFilter filter(camera(), *state);
  state.reset();
  Tracker plain;
  Workspace workspace;
  FeatureLabels labels;
  for (std::size_t i = 0; i < 3; ++i) {
    const Shot& shot = shots(0)[i];
    filter.apply(shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints, labels,
                 workspace);
    EXPECT_TRUE(are_equal(labels, plain.see(shot))) << i;
  }
}

TEST(MotionState, IsRefusedOnceItWasMovedFrom) {
  MotionState state;
  const MotionState other = std::move(state);
  expect_error<std::invalid_argument>([&] { MotionJudge(camera(), state); },
                                      "a state that was moved from");
}

}  // namespace
}  // namespace dynfilter::testing
