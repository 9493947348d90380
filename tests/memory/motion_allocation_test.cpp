// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A warm judge allocates nothing itself: no more than OpenCV does in the calls that track.

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <vector>

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "support/allocation_counter.hpp"

namespace dynfilter::testing {
namespace {

template <class Action>
std::size_t motion_allocations_of(const Action& action) {
  const std::size_t before = allocations_so_far();
  action();
  return allocations_so_far() - before;
}

TEST(MotionAllocations, AreThoseOfOpenCv) {
  if (!can_count_allocations) {
    GTEST_SKIP() << "allocations can only be counted with glibc and without sanitizers";
  }
  cv::setNumThreads(1);
  SyntheticSceneOptions options = scene_level("medium", 12);
  options.image_size = {480, 360};
  const SyntheticScene scene(options);
  const CameraParameters c = scene.camera();
  MotionJudge judge({c.fx, c.fy, c.cx, c.cy});
  const Pipeline<MaskCuller, Compensator> filter{MaskCuller(), Compensator()};
  Workspace workspace;
  FeatureLabels labels;
  cv::Mat1b now, half, quarter;
  constexpr std::size_t warm = 16;
  int compared = 0;
  for (std::size_t i = 0; i < 22; ++i) {
    const SyntheticFrame shot = scene.render(static_cast<int>(i % 11));
    FrameView frame = shot.frame;
    frame.timestamp_s = 1 + 0.04 * static_cast<double>(i);
    cv::Mat grey;
    std::vector<cv::Point2f> corners;
    cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
    cv::goodFeaturesToTrack(grey, corners, 500, 1e-3, 6);
    filter.apply(frame, shot.true_segmentation, corners, labels, workspace);
    const std::size_t of_judge = motion_allocations_of([&] {
      judge({frame, shot.true_segmentation, corners}, labels, workspace);
    });
    const MotionOutcome outcome = labels.statistics().motion.outcome;
    const std::size_t of_opencv = motion_allocations_of([&] {
      cv::cvtColor(frame.image, now, cv::COLOR_BGR2GRAY);
      cv::pyrDown(now, half);
      cv::pyrDown(half, quarter);
    });
    if (i >= warm && outcome == MotionOutcome::applied) {
      EXPECT_LE(of_judge, of_opencv) << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 0);
}

}  // namespace
}  // namespace dynfilter::testing
