// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "tools/mask_feed.hpp"

#include <chrono>
#include <vector>

#include <gtest/gtest.h>

namespace dynfilter::tools {
namespace {

using std::chrono::milliseconds;

constexpr double recorded_s = 1341846434.5;

/// Pace with a clock that advances to each frame's due time, as if the thread slept.
struct FakeCamera {
  FramePace pace;
  FramePace::Clock::time_point now{};

  /// Milliseconds that the frame with this time waits.
  double wait_ms(double timestamp_s) {
    const auto due = pace.due(timestamp_s, now);
    const double wait = std::chrono::duration<double, std::milli>(due - now).count();
    if (due > now) now = due;
    return wait;
  }
};

TEST(FramePace, FollowsTheTimestamps) {
  FakeCamera camera;
  EXPECT_EQ(camera.wait_ms(recorded_s), 0);
  EXPECT_NEAR(camera.wait_ms(recorded_s + 0.03), 30, 1e-3);
  EXPECT_NEAR(camera.wait_ms(recorded_s + 0.06), 30, 1e-3);
  camera.now += milliseconds(20);  // work
  EXPECT_NEAR(camera.wait_ms(recorded_s + 0.09), 10, 1e-3);
  EXPECT_NEAR(camera.wait_ms(recorded_s + 1.09), 1000, 1e-3) << "a second does not count as a jump";
  EXPECT_EQ(camera.pace.cuts(), 0U);
}

TEST(FramePace, LateFramesCatchUp) {
  FakeCamera camera;
  camera.wait_ms(recorded_s);
  camera.now += milliseconds(100);
  EXPECT_NEAR(camera.wait_ms(recorded_s + 0.03), -70, 1e-3);
  EXPECT_NEAR(camera.wait_ms(recorded_s + 0.13), 30, 1e-3);
}

TEST(FramePace, DoesNotWaitForJumps) {
  FakeCamera camera;
  camera.wait_ms(recorded_s);
  EXPECT_EQ(camera.wait_ms(recorded_s + 3600), 0);
  EXPECT_NEAR(camera.wait_ms(recorded_s + 3600.03), 30, 1e-3) << "the pace continues";
  EXPECT_EQ(camera.wait_ms(recorded_s), 0) << "back";
  EXPECT_NEAR(camera.wait_ms(recorded_s + 0.03), 30, 1e-3);
  EXPECT_EQ(camera.pace.cuts(), 2U);
  for (const double time_s : {-8.9e9, 8.9e9, -8.9e9}) EXPECT_EQ(camera.wait_ms(time_s), 0);
}

}  // namespace
}  // namespace dynfilter::tools
