// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A camera that only turns past a cart.

#include <gtest/gtest.h>

#include "motion/motion_frame.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Before a wall, a shift and a turn look alike, and together they explain the cart, too.
TEST(MotionTurn, DoesNotFollowTheCart) {
  SyntheticSceneOptions options = scene_level("rotation", 12);
  options.image_size = {480, 360};
  const SyntheticScene scene(options);
  Rig rig;
  for (int frame = 0; frame < 10; ++frame) {
    rig.see(shot_of(scene, frame));
    if (frame < 2) continue;  // in the first frame, the last motion is not known
    const auto& over = rig.workspace.get<detail::MotionScratch>().over[detail::short_baseline];
    EXPECT_TRUE(over.is_used) << frame;
    EXPECT_LT(cv::norm(over.pose.translation), 0.003) << frame;
  }
}

}  // namespace
}  // namespace dynfilter::testing
