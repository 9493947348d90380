// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// MotionJudge::track: tracks that are made before the masks are known.

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/feature_tracker.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Returns the tracks of a shot, made ahead of the call.
std::vector<FeatureTrack> tracked_ahead(Rig& rig, const Shot& shot) {
  std::vector<FeatureTrack> tracks;
  rig.judge.track(shot.rendered.frame, shot.keypoints, tracks, rig.workspace);
  EXPECT_EQ(tracks.size(), shot.keypoints.size());
  return tracks;
}

bool has_found_one(const std::vector<FeatureTrack>& tracks) {
  return std::any_of(tracks.begin(), tracks.end(),
                     [](const auto& track) { return track.is_found; });
}

/// Counts the features that two searches found at the same place, or not at all.
std::size_t count_equal(const std::vector<FeatureTrack>& a, const std::vector<FeatureTrack>& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool is_near = cv::norm(a[i].position - b[i].position) < 0.1;
    count += a[i].is_found == b[i].is_found && (is_near || !a[i].is_found) ? 1 : 0;
  }
  return count;
}

TEST(TrackingAhead, ChangesNoLabel) {
  Rig ahead, alone;
  const FeatureTracker tracker;
  ImagePyramid last, now;
  std::vector<FeatureTrack> plain;
  for (const Shot& shot : shots(0.5)) {
    const std::vector<FeatureTrack> tracks = tracked_ahead(ahead, shot);
    tracker.build(shot.rendered.frame.image, now);
    if (last.empty()) {
      EXPECT_FALSE(has_found_one(tracks));
    } else {
      tracker.track(now, last, shot.keypoints, nullptr, plain, alone.workspace);
      EXPECT_GT(count_equal(tracks, plain), tracks.size() * 9 / 10);
    }
    std::swap(last, now);
    const FeatureLabels labels = ahead.see(shot);
    const FeatureLabels same = alone.see(shot);
    EXPECT_TRUE(are_equal(labels, same));
    EXPECT_EQ(labels.statistics().motion.outcome, same.statistics().motion.outcome);
  }
}

TEST(TrackingAhead, ForgetsTracksOfAnotherFrame) {
  Rig ahead, alone;
  for (std::size_t i = 0; i < 6; ++i) {
    const Shot& shot = shots(0.5)[i];
    tracked_ahead(ahead, shots(0.5)[i + 1]);  // another time
    Shot fewer = shot;
    fewer.keypoints.pop_back();
    if (i == 4) tracked_ahead(ahead, fewer);  // another number of features
    EXPECT_TRUE(are_equal(ahead.see(shot), alone.see(shot))) << i;
  }
}

TEST(TrackingAhead, FindsNothingWhereTheLastFrameIsNotKnown) {
  Rig rig;
  const std::vector<Shot>& scene = shots(0.5);
  rig.see(scene[0]);
  Shot late = scene[1];
  late.rendered.frame.timestamp_s += 1;
  EXPECT_FALSE(has_found_one(tracked_ahead(rig, late)));
  rig.see(scene[1]);
  EXPECT_TRUE(has_found_one(tracked_ahead(rig, scene[2])));
  Shot blind = scene[2];
  blind.rendered.frame.image.release();
  EXPECT_FALSE(has_found_one(tracked_ahead(rig, blind)));
  EXPECT_FALSE(has_found_one(tracked_ahead(rig, scene[0])));  // back in time
}

}  // namespace
}  // namespace dynfilter::testing
