// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a host may do wrong, and what it may do beside motion.

#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

TEST(MotionMisuse, TracksOfAnotherNumberAreRefusedInEachFrame) {
  Rig rig, plain;
  for (std::size_t i = 0; i < 5; ++i) {
    const Shot& shot = shots(0)[i];
    rig.judge.hand_over_tracks(std::vector<FeatureTrack>(5));
    expect_error<std::invalid_argument>([&] { rig.see(shot); }, "5 tracks of the host and");
    // They are of the refused call alone, which forgets no frame.
    EXPECT_TRUE(are_equal(rig.see(shot), plain.see(shot))) << i;
  }
}

TEST(MotionMisuse, APriorOfARefusedFrameIsDropped) {
  Rig rig, plain;
  for (std::size_t i = 0; i < 3; ++i) {
    rig.see(shots(0)[i]);
    plain.see(shots(0)[i]);
  }
  PosePrior wrong;
  wrong.pose.translation = {0.5, 0, 0};
  wrong.is_trusted = true;
  rig.judge.expect_motion(wrong);
  Shot odd = shots(0)[3];
  odd.rendered.frame.image.convertTo(odd.rendered.frame.image, CV_16U);
  EXPECT_THROW(rig.see(odd), std::invalid_argument);
  EXPECT_TRUE(are_equal(rig.see(shots(0)[3]), plain.see(shots(0)[3])));
}

/// Motion gives back what masks and depth took, not what a stage of the host's removed.
TEST(MotionMisuse, LeavesToTheHostWhatItRemoved) {
  Rig rig;
  std::size_t removed_by_host = 0;
  for (std::size_t i = 0; i < 9; ++i) {
    const Shot& shot = shots(0)[i];
    FeatureLabels labels =
        Pipeline<MaskCuller>(MaskCuller())
            .apply(shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints);
    std::vector<std::size_t> of_host;
    for (std::size_t f = 0; f < labels.size(); ++f) {
      const bool is_chosen = labels.is_removed(f) && f % 3 == 0;
      if (!is_chosen) continue;
      const FeatureLabel label = labels[f];
      labels.restore(f);
      labels.remove(f, label.instance, Reason::custom, 1);
      of_host.push_back(f);
    }
    rig.judge({shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints}, labels,
              rig.workspace);
    for (const std::size_t f : of_host) EXPECT_EQ(labels[f].reason, Reason::custom) << i;
    if (i == 8) {
      EXPECT_GT(labels.statistics().motion.given_back, 20U);
      removed_by_host = of_host.size();
    }
  }
  EXPECT_GT(removed_by_host, 20U);
}

/// Returns what a host knows exactly of the motion into a frame.
PosePrior exact_prior(int frame) {
  static const SyntheticScene scene(small_scene(0));
  const CameraPose now = scene.pose(frame), then = scene.pose(frame - 1);
  PosePrior prior;
  prior.pose = {then.rotation.t() * now.rotation,
                then.rotation.t() * (now.translation - then.translation)};
  prior.max_translation_m = prior.max_rotation_rad = 1e-3;
  prior.is_trusted = true;
  return prior;
}

/// Sees frames without depth, of which one repeats the image before it. Returns the frames that
/// were judged after that, and those in which features were removed.
std::pair<int, int> seen_after_repeat(bool repeats, bool knows_repeat = true) {
  constexpr int repeated = 4;
  Rig rig;
  int judged = 0, removing = 0;
  for (int i = 0; i < 9; ++i) {
    const bool is_repeat = repeats && i == repeated;
    const Shot& shot = shots(0)[static_cast<std::size_t>(is_repeat ? i - 1 : i)];
    FrameView frame = shot.rendered.frame;
    frame.depth = cv::Mat();
    frame.timestamp_s = shots(0)[static_cast<std::size_t>(i)].rendered.frame.timestamp_s;
    if (i > 0 && (!is_repeat || knows_repeat)) rig.judge.expect_motion(exact_prior(i));
    const FeatureLabels labels = rig.see(frame, {}, shot.keypoints);
    if (is_repeat) {
      EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::repeated);
    }
    if (i <= repeated) continue;
    judged += labels.statistics().motion.outcome == MotionOutcome::applied ? 1 : 0;
    removing += labels.statistics().moving > 0 ? 1 : 0;
  }
  return {judged, removing};
}

/// The prior of the frame after a repeated image begins there, and not at the last image.
TEST(MotionMisuse, PriorsAreJoinedOverARepeatedImage) {
  const std::pair<int, int> all_right(4, 0);
  EXPECT_EQ(seen_after_repeat(false), all_right);
  EXPECT_EQ(seen_after_repeat(true), all_right);
  const std::pair<int, int> one_not_judged(3, 0);
  EXPECT_EQ(seen_after_repeat(true, false), one_not_judged);
}

/// A rotation in float is a little off an orthonormal one, which adds up over three frames.
TEST(MotionMisuse, TakesPriorsInFloat) {
  Rig rig;
  for (Shot shot : shots(0)) {
    shot.rendered.frame.depth.release();
    PosePrior prior;
    prior.pose.rotation = prior.pose.rotation * 1.00025;
    prior.is_trusted = true;
    rig.judge.expect_motion(prior);
    EXPECT_NO_THROW(rig.see(shot));
  }
}

}  // namespace
}  // namespace dynfilter::testing
