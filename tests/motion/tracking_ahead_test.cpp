// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// MotionJudge::track: tracks that are made before the masks are known.

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/feature_tracker.hpp"
#include "motion/motion_measurement.hpp"
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

/// Returns the tracks that the judge made in its last call.
const std::vector<FeatureTrack>& tracks_of(Rig& rig) {
  return rig.workspace.get<detail::MotionMeasurement>().baselines[0].tracks;
}

bool are_same_tracks(const std::vector<FeatureTrack>& a, const std::vector<FeatureTrack>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.is_found == y.is_found && x.position == y.position;
  });
}

/// Counts the features that two searches found at about the same place, or not at all.
std::size_t count_near(const std::vector<FeatureTrack>& a, const std::vector<FeatureTrack>& b) {
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
  Workspace workspace;
  ImagePyramid last, now;
  std::vector<FeatureTrack> plain;  // of a search that expects nothing
  for (const Shot& shot : shots(0.5)) {
    const std::vector<FeatureTrack> tracks = tracked_ahead(ahead, shot);
    tracker.build(shot.rendered.frame.image, now);
    if (last.empty()) {
      EXPECT_FALSE(has_found_one(tracks));
    } else {
      tracker.track(now, last, shot.keypoints, nullptr, plain, workspace);
      EXPECT_GT(count_near(tracks, plain), tracks.size() * 9 / 10);
    }
    const FeatureLabels labels = ahead.see(shot);
    const FeatureLabels same = alone.see(shot);
    if (!last.empty()) {
      EXPECT_TRUE(are_same_tracks(tracks, tracks_of(alone)));
    }
    std::swap(last, now);
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
