// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_filter.hpp"
#include "support/motion_rig.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Class of a host that holds a filter.
struct Tracker {
  Tracker() : filter(camera()) {}

  FeatureLabels see(const Shot& shot) {
    FeatureLabels labels;
    filter.apply(shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints, labels,
                 workspace);
    return labels;
  }

  MotionFilter filter;
  Workspace workspace;
};

TEST(MotionFilter, MayBeMoved) {
  Tracker resting;
  std::vector<Tracker> moved(1);
  for (std::size_t i = 0; i < 7; ++i) {
    if (i == 2) moved.reserve(moved.capacity() + 1);  // moves what it holds
    if (i == 4) {
      Tracker other;
      other = std::move(moved[0]);
      moved[0] = std::move(other);
    }
    EXPECT_TRUE(same_labels(moved[0].see(shots(0)[i]), resting.see(shots(0)[i]))) << i;
  }
  const InstanceVerdict verdict = resting.see(shots(0)[7]).statistics().instances[0].verdict;
  EXPECT_EQ(verdict, InstanceVerdict::still) << "the filters had something to remember";
}

TEST(MotionFilter, IsLikeNewAfterAReset) {
  Tracker used, fresh;
  for (std::size_t i = 0; i < 5; ++i) used.see(shots(0.5)[i]);
  used.filter.judge().reset();
  for (std::size_t i = 5; i < 9; ++i) {
    EXPECT_TRUE(same_labels(used.see(shots(0.5)[i]), fresh.see(shots(0.5)[i]))) << i;
  }
}

/// Returns the index of the first frame in which motion is decided; none if it never is. The masks
/// begin at a frame.
std::optional<std::size_t> first_decided(double speed_m_s, std::size_t first_masks) {
  MotionFilter filter(camera());
  Workspace workspace;
  FeatureLabels labels;
  for (std::size_t i = 0; i < frames; ++i) {
    const Shot& shot = shots(speed_m_s)[i];
    std::optional<Segmentation> masks;
    if (i >= first_masks) masks = shot.rendered.true_segmentation;
    filter.apply(shot.rendered.frame, masks, shot.keypoints, labels, workspace);
    if (labels.statistics().is_motion_decided()) return i;
  }
  return {};
}

TEST(MotionDecided, WherePeopleAreStillOrMoveInSomeFrames) {
  const auto still = first_decided(0, 0), walking = first_decided(0.5, 0);
  ASSERT_TRUE(still && walking);
  const auto still_frames = static_cast<std::size_t>(MotionJudgeOptions().still_frames);
  EXPECT_GE(*still, still_frames + 3) << "one frame that is not quiet must not change it";
  EXPECT_LE(*still, 10U);
  EXPECT_GE(*walking, 3U);
  EXPECT_LE(*walking, 5U);
}

/// Before the first masks, nobody knows that people stand there.
TEST(MotionDecided, NeverBeforeTheFirstMasks) {
  EXPECT_EQ(first_decided(0, frames), std::nullopt);
  const auto late = first_decided(0, 4);
  ASSERT_TRUE(late);
  EXPECT_GE(*late, 4U + static_cast<std::size_t>(MotionJudgeOptions().still_frames) - 1);
}

/// "No masks" is not "nobody": who stood before a frame without masks stands after it.
TEST(MotionMasks, RemembersVerdictsOverFramesWithoutMasks) {
  Rig rig;
  for (const Shot& shot : shots(0)) {
    const std::size_t i = static_cast<std::size_t>(&shot - shots(0).data());
    if (i == 8 || i == 9 || i == 11) {
      rig.see_without_masks(shot);
      continue;
    }
    const FeatureLabels labels = rig.see(shot);
    if (i < 7) continue;
    EXPECT_EQ(labels.statistics().instances[0].verdict, InstanceVerdict::still) << i;
  }
}

/// A person who was not seen for longer than a gap may be another one.
TEST(MotionMasks, ForgetsVerdictsAfterAGapOfMasks) {
  MotionJudgeOptions options;
  options.max_gap_s = 0.09;
  Rig rig(options);
  for (std::size_t i = 0; i < 8; ++i) rig.see(shots(0)[i]);
  for (const std::size_t i : {8U, 9U}) rig.see_without_masks(shots(0)[i]);
  const FeatureLabels labels = rig.see(shots(0)[10]);
  EXPECT_EQ(labels.statistics().motion.outcome, MotionOutcome::applied);
  EXPECT_EQ(labels.statistics().instances[0].verdict, InstanceVerdict::undecided);
}

/// Masks whose time was not set are not stale for motion either.
TEST(MotionMasks, TakesMasksWithoutATimeForFresh) {
  Rig rig, other;
  std::size_t moving = 0;
  for (Shot shot : shots(0.5)) {
    const FeatureLabels fresh = rig.see(shot);
    shot.rendered.true_segmentation.timestamp_s.reset();
    EXPECT_TRUE(same_labels(other.see(shot), fresh));
    moving += fresh.statistics().moving;
  }
  EXPECT_GT(moving, 0U);
}

/// As the scores of the other stages, that of a feature that comes back counts the detector's
/// confidence.
TEST(MotionMasks, ConfidenceScalesTheScoresOfWhatIsKept) {
  Rig sure, doubtful;
  std::size_t restored = 0;
  for (Shot shot : shots(0)) {
    const FeatureLabels by_sure = sure.see(shot);
    for (Instance& person : shot.rendered.true_segmentation.instances) person.score *= 0.5F;
    const FeatureLabels by_doubtful = doubtful.see(shot);
    for (std::size_t i = 0; i < by_sure.size(); ++i) {
      EXPECT_EQ(by_sure[i].reason, by_doubtful[i].reason);
      if (by_sure[i].reason != Reason::still) continue;
      EXPECT_FLOAT_EQ(by_doubtful[i].score, 0.5F * by_sure[i].score);
      restored += by_sure[i].score > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(restored, 100U);
}

// --- What a host may do wrong, and what it may do beside motion ----------------------------------

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
  EXPECT_TRUE(same_labels(rig.see(shots(0)[3]), plain.see(shots(0)[3])));
}

/// Motion keeps what masks and depth removed, not what a stage of the host's removed.
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
      EXPECT_GT(labels.statistics().motion.kept_still, 20U);
      removed_by_host = of_host.size();
    }
  }
  EXPECT_GT(removed_by_host, 20U);
}

/// Returns what a host knows exactly, to a millimetre, of the motion into a frame.
PosePrior millimetre_prior(int frame) {
  static const SyntheticScene scene(small_scene(0));
  PosePrior prior = exact_prior(scene, frame);
  prior.max_translation_m = prior.max_rotation_rad = 1e-3;
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
    if (i > 0 && (!is_repeat || knows_repeat)) rig.judge.expect_motion(millimetre_prior(i));
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
