// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Moved masks on rendered persons, whose true masks are known.

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "dynfilter/segmenters/mask_propagator.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "support/scene_images.hpp"

namespace dynfilter {
namespace {

using testing::painted;

constexpr int max_lag = 6;

double iou(const cv::Mat& a, const cv::Mat& b) {
  return double{1} * cv::countNonZero(a & b) / cv::countNonZero(a | b);
}

/// Intersection over union with the true masks, by lag, if the masks of the first frame move, if
/// they stay, and if they arrive `max_lag` frames late.
struct Overlaps {
  std::map<int, double> moved, left;
  double late = 0;
};

Overlaps overlaps(const char* level, std::uint64_t seed, int start) {
  const SyntheticScene scene(scene_level(level, seed));
  MaskPropagator in_time, late;
  std::optional<Segmentation> newest;
  Overlaps result;
  for (int lag = 0; lag <= max_lag; ++lag) {
    const SyntheticFrame frame = scene.render(start + lag);
    if (lag == 0) newest = frame.true_segmentation;
    const auto moved = in_time.propagate(frame.frame, newest);
    const auto moved_late =
        late.propagate(frame.frame, lag == max_lag ? newest : std::optional<Segmentation>());
    const cv::Mat truth = painted(frame.true_segmentation);
    result.moved[lag] = iou(painted(*moved), truth);
    result.left[lag] = iou(painted(*newest), truth);
    if (moved_late) result.late = iou(painted(*moved_late), truth);
  }
  return result;
}

struct Case {
  const char* level;
  int start;
  double after_1, after_3, after_6, late;  // lower bounds; measured values are at least 0.03 higher
};

class MaskPropagatorScenes : public ::testing::TestWithParam<Case> {};

TEST_P(MaskPropagatorScenes, MovedMasksOverlapMoreThanStaleMasks) {
  const Case& want = GetParam();
  Overlaps got = overlaps(want.level, 41, want.start);
  EXPECT_EQ(got.moved[0], 1);
  EXPECT_GE(got.moved[1], want.after_1);
  EXPECT_GE(got.moved[3], want.after_3);
  EXPECT_GE(got.moved[6], want.after_6);
  EXPECT_GE(got.late, want.late);
  EXPECT_GE(1 - got.left[1], 1.5 * (1 - got.moved[1]));
  EXPECT_GE(1 - got.left[3], 1.5 * (1 - got.moved[3]));
  EXPECT_GE(1 - got.left[6], 1.5 * (1 - got.moved[6]));
}

INSTANTIATE_TEST_SUITE_P(Levels, MaskPropagatorScenes,
                         ::testing::Values(Case{"medium", 60, 0.95, 0.91, 0.88, 0.87},
                                           Case{"together", 60, 0.9, 0.78, 0.64, 0.58}),
                         [](const auto& test) { return std::string(test.param.level); });

}  // namespace
}  // namespace dynfilter
