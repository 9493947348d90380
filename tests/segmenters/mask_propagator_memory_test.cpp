// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A propagator after a call with a failed allocation.

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "support/failing_allocations.hpp"
#include "support/scene_images.hpp"

namespace dynfilter {
namespace {

using testing::fails_at_allocation;
using testing::for_each_failing_allocation;
using testing::same;

const cv::Size size(96, 72);

/// Textured scene with two masks that moves three pixels a frame to the right.
class Film {
 public:
  Film() : wide_(size.height, 2 * size.width) {
    cv::RNG(5).fill(wide_, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(wide_, wide_, cv::Size(), 1.5);
    cv::normalize(wide_, wide_, 0, 255, cv::NORM_MINMAX);
  }

  FrameView frame(int index) const {
    FrameView frame;
    frame.id = static_cast<std::uint64_t>(index);
    frame.timestamp_s = 1.0 + index / 30.0;
    frame.image = wide_(cv::Rect({size.width / 2 - 3 * index, 0}, size));
    return frame;
  }

  Segmentation masks(int index) const {
    const FrameView view = frame(index);
    const cv::Mat mask(36, 24, CV_8UC1, cv::Scalar(255));
    return {view.id,
            view.timestamp_s,
            size,
            {Instance::from_box_mask(mask, {{12 + 3 * index, 18}, mask.size()}),
             Instance::from_box_mask(mask, {{52 + 3 * index, 24}, mask.size()})}};
  }

 private:
  cv::Mat1b wide_;
};

/// Expects the same result of two propagators, except for track ids.
void expect_same(const std::optional<Segmentation>& got, const std::optional<Segmentation>& want,
                 const std::string& when) {
  SCOPED_TRACE(when);
  ASSERT_EQ(got.has_value(), want.has_value());
  if (!got) return;
  EXPECT_EQ(got->frame_id, want->frame_id);
  EXPECT_EQ(got->timestamp_s, want->timestamp_s);
  ASSERT_EQ(got->instances.size(), want->instances.size());
  for (std::size_t i = 0; i < got->instances.size(); ++i) {
    EXPECT_EQ(got->instances[i].box, want->instances[i].box);
    EXPECT_EQ(got->instances[i].mask_origin, want->instances[i].mask_origin);
    EXPECT_TRUE(same(got->instances[i].mask, want->instances[i].mask));
  }
}

/// Propagates frames 0 to `failing` - 1, then lets every allocation of frame `failing` fail in
/// turn. Expects that later frames give the results of a propagator that saw no earlier frame.
void expect_new_start_after(int failing) {
  const Film film;
  const auto newest = [&](int frame) { return film.masks(frame >= failing ? failing : 0); };
  MaskPropagator undisturbed;
  std::optional<Segmentation> want;
  for (int i = 0; i <= failing; ++i) want = undisturbed.propagate(film.frame(i), newest(i));
  const std::size_t failures = for_each_failing_allocation([&](const std::size_t n) {
    MaskPropagator propagator;
    for (int i = 0; i < failing; ++i) propagator.propagate(film.frame(i), newest(i));
    const FrameView frame = film.frame(failing);
    const std::optional<Segmentation> result = newest(failing);
    std::optional<std::optional<Segmentation>> at_once;
    const bool has_failed =
        fails_at_allocation(n, [&] { at_once = propagator.propagate(frame, result); });
    if (at_once) {  // it succeeded without that memory
      expect_same(*at_once, want, "when allocation " + std::to_string(n) + " failed");
      return has_failed;
    }
    EXPECT_TRUE(propagator.statistics().restarted);
    MaskPropagator fresh;
    for (int i = failing + 1; i < failing + 4; ++i) {
      const std::optional<Segmentation> got = propagator.propagate(film.frame(i), newest(i));
      expect_same(got, fresh.propagate(film.frame(i), newest(i)),
                  "frame " + std::to_string(i) + " after allocation " + std::to_string(n));
      EXPECT_EQ(propagator.statistics().tracked_points, fresh.statistics().tracked_points);
    }
    return !::testing::Test::HasFailure();
  });
  EXPECT_GT(failures, 50u);
}

class MaskPropagatorWithoutMemory : public ::testing::Test {
 protected:
  void SetUp() override { cv::setNumThreads(1); }  // allocations fail only in this thread
  void TearDown() override { cv::setNumThreads(-1); }
};

TEST_F(MaskPropagatorWithoutMemory, FailedFirstCallRestartsIt) { expect_new_start_after(0); }

TEST_F(MaskPropagatorWithoutMemory, FailedSecondCallRestartsIt) { expect_new_start_after(1); }

TEST_F(MaskPropagatorWithoutMemory, FailedLaterCallRestartsIt) { expect_new_start_after(4); }

TEST_F(MaskPropagatorWithoutMemory, FailedFrameMayBeRepeated) {
  const Film film;
  MaskPropagator propagator, fresh;
  propagator.propagate(film.frame(0), film.masks(0));
  ASSERT_TRUE(fails_at_allocation(5, [&] { propagator.propagate(film.frame(1), {}); }));
  expect_same(propagator.propagate(film.frame(1), film.masks(0)),
              fresh.propagate(film.frame(1), film.masks(0)), "frame 1 again");
  EXPECT_FALSE(propagator.statistics().restarted);
}

TEST_F(MaskPropagatorWithoutMemory, TrackIdsAreNotReused) {
  const Film film;
  MaskPropagator propagator;
  const auto before = propagator.propagate(film.frame(0), film.masks(0));
  ASSERT_TRUE(fails_at_allocation(5, [&] { propagator.propagate(film.frame(1), {}); }));
  const auto after = propagator.propagate(film.frame(2), film.masks(2));
  ASSERT_EQ(before->instances.back().track_id, 1);
  EXPECT_EQ(after->instances.front().track_id, 2);
}

}  // namespace
}  // namespace dynfilter
