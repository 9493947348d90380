// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <gtest/gtest.h>

#include "dynfilter/segmenters/silhouette_lag_estimator.hpp"
#include "support/failing_allocations.hpp"

namespace dynfilter {
namespace {

constexpr int frames = 60;

/// A board 1 m away that swings before a wall 3 m away.
cv::Rect board(int i) { return {cvRound(100 + 50 * std::sin(0.12 * i)), 20, 40, 60}; }

FrameView frame_at(int i) {
  FrameView frame;
  frame.timestamp_s = i / 30.0;
  frame.depth = cv::Mat(100, 240, CV_16UC1, cv::Scalar::all(3000));
  frame.metres_per_unit = 1.0 / 1000;
  frame.depth(board(i)).setTo(1000);
  return frame;
}

Segmentation masks_at(int i) {
  cv::Mat mask = cv::Mat::zeros(100, 240, CV_8UC1);
  mask(board(i)).setTo(255);
  return {static_cast<std::uint64_t>(i), i / 30.0, mask.size(), {Instance::from_image_mask(mask)}};
}

/// An allocation fails in the add() of a frame in the middle, which is then added again.
TEST(SilhouetteLagEstimator, IsRightAfterAnyFailedAllocation) {
  const auto feed = [](SilhouetteLagEstimator& estimator, int first, int end) {
    for (int i = first; i < end; ++i) estimator.add(frame_at(i), masks_at(i));
  };
  SilhouetteLagEstimator undisturbed;
  feed(undisturbed, 0, frames);
  const auto want = undisturbed.estimate();
  ASSERT_TRUE(want);
  const std::size_t failures = testing::for_each_failing_allocation([&](std::size_t n) {
    SilhouetteLagEstimator estimator;
    feed(estimator, 0, frames / 2);
    FrameView frame = frame_at(frames / 2);
    const Segmentation masks = masks_at(frames / 2);
    const bool failed = testing::fails_at_allocation(n, [&] { estimator.add(frame, masks); });
    frame.depth.setTo(0);  // the driver fills its buffer anew
    feed(estimator, failed ? frames / 2 : frames / 2 + 1, frames);
    const auto got = estimator.estimate();
    EXPECT_TRUE(got);
    if (!got) return failed;
    EXPECT_NEAR(got->frames_late, want->frames_late, 0.02) << n;
    // At most the edges of the two triples that a fresh start costs are missing, and none is there
    // twice but those of the frame at hand.
    EXPECT_GE(got->edges + 6, want->edges) << n;
    EXPECT_LE(got->edges, want->edges + 2) << n;
    return failed;
  });
  EXPECT_GT(failures, 3U);
}

}  // namespace
}  // namespace dynfilter
