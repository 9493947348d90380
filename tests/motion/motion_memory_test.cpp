// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The motion filter and its memory after a call with a failed allocation.

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <cstddef>
#include <optional>
#include <tuple>
#include <vector>

#include "dynfilter/motion/motion_filter.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "support/answer.hpp"

namespace dynfilter::testing {
namespace {

struct Shot {
  SyntheticFrame rendered;
  std::vector<cv::Point2f> corners;
};

const SyntheticScene& scene() {
  static const SyntheticScene made = [] {
    SyntheticSceneOptions options = scene_level("medium", 12);
    options.image_size = {160, 120};
    return SyntheticScene(options);
  }();
  return made;
}

const std::vector<Shot>& shots() {
  static const std::vector<Shot> made = [] {
    std::vector<Shot> result;
    for (int i = 0; i < 7; ++i) {
      Shot shot{scene().render(i), {}};
      cv::Mat grey;
      cv::cvtColor(shot.rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
      cv::goodFeaturesToTrack(grey, shot.corners, 150, 1e-3, 4);
      result.push_back(shot);
    }
    return result;
  }();
  return made;
}

struct Rig {
  explicit Rig(bool ahead) : tracks_ahead(ahead) {}

  bool tracks_ahead;  // calls MotionJudge::track before each frame
  std::vector<FeatureTrack> tracks;
  MotionState state;
  MotionFilter filter{
      {scene().camera().fx, scene().camera().fy, scene().camera().cx, scene().camera().cy}, state};
  FeatureLabels labels;
  Workspace workspace;

  Answer see(std::size_t i) {
    const Shot& shot = shots()[i];
    if (tracks_ahead) {
      filter.stage<MotionJudge>().track(shot.rendered.frame, shot.corners, tracks, workspace);
    }
    filter.apply(shot.rendered.frame, shot.rendered.true_segmentation, shot.corners, labels,
                 workspace);
    const MotionStatistics& motion = labels.statistics().motion;
    return Answer()
        .add(labels)
        .add(static_cast<int>(motion.outcome))
        .add(static_cast<double>(motion.tracked));
  }
};

class MotionFilterWithoutMemory : public ::testing::TestWithParam<std::tuple<std::size_t, bool>> {
 protected:
  void SetUp() override { cv::setNumThreads(1); }  // allocations fail only in this thread
  void TearDown() override { cv::setNumThreads(-1); }
};

/// Lets every allocation of a frame fail in turn. Later frames then give the labels of a filter
/// that saw nothing before. Where the failure came before or after the motion was judged, they are
/// those of a filter that missed this frame or saw it.
TEST_P(MotionFilterWithoutMemory, LaterFramesAreThoseOfAKnownHistory) {
  const auto [failing, tracks_ahead] = GetParam();
  Rig fresh(tracks_ahead), missed(tracks_ahead), seen(tracks_ahead);
  for (std::size_t i = 0; i < failing; ++i) {
    missed.see(i);
    seen.see(i);
  }
  const Answer of_failing = seen.see(failing);
  std::vector<Answer> of_fresh, of_missed, of_seen;
  for (std::size_t i = failing + 1; i < shots().size(); ++i) {
    of_fresh.push_back(fresh.see(i));
    of_missed.push_back(missed.see(i));
    of_seen.push_back(seen.see(i));
  }
  ASSERT_EQ(fresh.labels.statistics().motion.outcome, MotionOutcome::applied);
  const std::size_t failures =
      for_each_failing_allocation([&, frame = failing, ahead = tracks_ahead](std::size_t n) {
        Rig rig(ahead);
        for (std::size_t i = 0; i < frame; ++i) rig.see(i);
        std::optional<Answer> got;
        const bool has_failed = fails_at_allocation(n, [&] { got = rig.see(frame); });
        if (got) {  // it succeeded without that memory
          EXPECT_TRUE(*got == of_failing) << "when allocation " << n << " failed";
          return has_failed;
        }
        std::vector<Answer> later;
        for (std::size_t i = frame + 1; i < shots().size(); ++i) later.push_back(rig.see(i));
        EXPECT_TRUE(later == of_fresh || later == of_missed || later == of_seen)
            << "after allocation " << n << " failed";
        return !::testing::Test::HasFailure();
      });
  EXPECT_GT(failures, 10U);
}

INSTANTIATE_TEST_SUITE_P(Frames, MotionFilterWithoutMemory,
                         ::testing::Combine(::testing::Values(0, 1, 4), ::testing::Bool()));

}  // namespace
}  // namespace dynfilter::testing
