// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features that a compensator removed beside a person.

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "motion/motion_measurement.hpp"
#include "support/motion_rig.hpp"

namespace dynfilter::testing {
namespace {

/// Returns how many of the features come back in each frame that a compensator removed 20 to 60
/// pixels from a person of this speed.
std::vector<std::size_t> given_back(const MotionJudgeOptions& options, double speed_m_s) {
  Rig rig(options);
  std::vector<std::size_t> counts;
  for (const Shot& shot : shots(speed_m_s)) {
    const FrameView& frame = shot.rendered.frame;
    const Segmentation& masks = shot.rendered.true_segmentation;
    FeatureLabels labels = Pipeline<MaskCuller>(MaskCuller()).apply(frame, masks, shot.keypoints);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::Point pixel = nearest_pixel(shot.keypoints[i].pt);
      for (std::size_t k = 0; k < masks.instances.size() && !labels.is_removed(i); ++k) {
        const Instance& person = masks.instances[k];
        if (detail::mask_within(person, pixel, 20) || !detail::mask_within(person, pixel, 60)) {
          continue;
        }
        labels.remove(i, static_cast<std::int32_t>(k), Reason::compensated, 0.6F);
      }
    }
    rig.judge({frame, masks, shot.keypoints}, labels, rig.workspace);
    counts.push_back(labels.statistics().motion.given_back);
  }
  return counts;
}

/// Returns how many come back in all beside a person who walks.
std::size_t given_back_beside_a_walker(const MotionJudgeOptions& options) {
  const std::vector<std::size_t> counts = given_back(options, 0.5);
  return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

TEST(MotionBackground, ComesBackIfTracksOrImageShowItStillAtOneDepth) {
  const std::size_t by_both = given_back_beside_a_walker({});
  MotionJudgeOptions options;
  options.max_static_patch_ratio = 0;  // nothing looks so much alike
  const std::size_t by_tracks = given_back_beside_a_walker(options);
  EXPECT_GT(by_tracks, 100U);
  EXPECT_GT(by_both, by_tracks + 20);
  options.max_clear_ratio = 0;  // nor is any track so near to the static place
  EXPECT_EQ(given_back_beside_a_walker(options), 0U);
  options = {};
  options.max_background_depth_range_m = 0;  // no depth spans less
  EXPECT_EQ(given_back_beside_a_walker(options), 0U);
}

/// A person's verdict takes frames. A map that begins without anything near him suffers until then.
TEST(MotionBackground, ComesBackAtOnceBesideAPersonWhoNeverMoved) {
  MotionJudgeOptions options;
  options.max_static_patch_ratio = 0;  // what comes back in any case does not count here
  const std::vector<std::size_t> counts = given_back(options, 0);
  EXPECT_EQ(counts[0], 0U);
  EXPECT_GT(counts[1], 50U);
  EXPECT_GT(counts[2], 50U);
  const std::vector<std::size_t> beside_a_walker = given_back(options, 0.5);
  EXPECT_EQ(beside_a_walker[1], 0U);
  EXPECT_EQ(beside_a_walker[2], 0U);
}

/// On a person who stands, a feature whose track fails comes back if the image shows it still.
TEST(MotionBackground, OnAPersonWhoStandsComesBackWithoutTracks) {
  Rig rig;
  const std::vector<Shot>& all = shots(0);
  for (std::size_t i = 0; i + 1 < all.size(); ++i) rig.see(all[i]);
  const Shot& last = all.back();
  const FeatureTracker tracker;
  ImagePyramid now, then;
  tracker.build(last.rendered.frame.image, now);
  tracker.build(all[all.size() - 2].rendered.frame.image, then);
  std::vector<FeatureTrack> tracks;
  tracker.track(now, then, last.keypoints, nullptr, tracks, rig.workspace);
  const FeatureLabels masked =
      Pipeline<MaskCuller>(MaskCuller())
          .apply(last.rendered.frame, last.rendered.true_segmentation, last.keypoints);
  std::vector<std::size_t> lost;
  for (std::size_t i = 0; i < tracks.size(); i += 3) {
    tracks[i].is_found = false;
    if (masked.is_removed(i)) lost.push_back(i);
  }
  rig.state.hand_over_tracks(0, tracks);
  rig.state.hand_over_tracks(1, std::vector<FeatureTrack>(tracks.size()));
  const FeatureLabels labels = rig.see(last);
  std::size_t kept = 0;
  for (const std::size_t i : lost) kept += labels.is_removed(i) ? 0 : 1;
  EXPECT_GT(lost.size(), 20U);
  EXPECT_GT(kept, lost.size() / 2);
}

/// Where persons are too much of the view, the camera's motion may have been taken from them.
TEST(MotionBackground, DoesNotComeBackAtOnceInACrowd) {
  MotionJudgeOptions options;
  options.min_kept_share = 1;
  for (const double speed_m_s : {0.0, 0.5}) {
    const std::vector<std::size_t> counts = given_back(options, speed_m_s);
    EXPECT_EQ(counts[1], 0U);
    EXPECT_EQ(counts[2], 0U);
  }
}

/// Returns the depth of the farthest moving pixel, metres.
double farthest_moving_m(const SyntheticFrame& rendered) {
  double farthest_m = 0;
  cv::minMaxLoc(rendered.exact_depth_m, nullptr, &farthest_m, nullptr, nullptr,
                rendered.moving_mask);
  return farthest_m;
}

/// Counts the features that are removed beside people who walk: those whose depth is at least
/// 0.5 m behind every person, and the others.
struct Beside {
  std::size_t far_behind = 0, others = 0;
};

Beside removed_beside(const MotionJudgeOptions& options, double mask_age_s = 0) {
  Rig rig(options);
  Beside removed;
  for (const Shot& shot : shots(0.5)) {
    Segmentation masks = shot.rendered.true_segmentation;
    masks.timestamp_s -= mask_age_s;
    const FeatureLabels labels = rig.see(shot.rendered.frame, masks, shot.keypoints);
    const double farthest_m = farthest_moving_m(shot.rendered);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (labels[i].reason != Reason::moving || labels[i].instance < 0) continue;
      const auto depth_m = shot.rendered.frame.depth_m(nearest_pixel(shot.keypoints[i].pt));
      ++(depth_m && *depth_m > farthest_m + 0.5 ? removed.far_behind : removed.others);
    }
  }
  return removed;
}

/// Beside a person, masks and tracks fail. Depth tells the wall behind him from what may be his.
TEST(MotionBackground, FarBehindAPersonIsNotInHisFringe) {
  MotionJudgeOptions options;
  options.max_thing_depth_m = 100;  // depth tells nothing
  EXPECT_GT(removed_beside(options).far_behind, 10U);
  const Beside removed = removed_beside({});
  EXPECT_EQ(removed.far_behind, 0U);
  EXPECT_GT(removed.others, 10U);
  // On old masks are other things' features, whose depths say nothing.
  EXPECT_GT(removed_beside({}, 0.1).far_behind, 10U);
}

/// Counts the features that are removed beside people who walk because they were not tracked,
/// farther than a distance from the mask.
std::size_t untracked_removed(double mask_age_s, double distance_px) {
  Rig rig;
  std::size_t count = 0;
  for (const Shot& shot : shots(0.5)) {
    Segmentation masks = shot.rendered.true_segmentation;
    masks.timestamp_s -= mask_age_s;
    const FeatureLabels labels = rig.see(shot.rendered.frame, masks, shot.keypoints);
    const auto& measured = rig.workspace.get<detail::MotionMeasurement>();
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const bool is_beside = labels[i].reason == Reason::moving && labels[i].instance >= 0;
      if (!is_beside || measured.motions[i].was_tracked()) continue;
      const Instance& person = masks.instances[static_cast<std::size_t>(labels[i].instance)];
      const cv::Point pixel = nearest_pixel(shot.keypoints[i].pt);
      count += detail::mask_within(person, pixel, distance_px) ? 0 : 1;
    }
  }
  return count;
}

/// What a person hid until now has no track. Fresh masks miss little of him.
TEST(MotionBackground, IsSparedWhereAPersonHidItAndMasksAreFresh) {
  EXPECT_GT(untracked_removed(0, 0), 0U);
  EXPECT_EQ(untracked_removed(0, 4), 0U);
  EXPECT_GT(untracked_removed(0.1, 4), 0U);
  EXPECT_EQ(untracked_removed(0.1, 15), 0U);
}

/// The shadow beside a person has no depth, and what comes out of it has no track.
TEST(MotionBackground, WithoutTrackAndDepthIsNotFilledUp) {
  Rig rig;
  std::size_t unseen = 0;
  for (std::size_t n = 0; n < shots(0.5).size(); ++n) {
    const Shot& shot = shots(0.5)[n];
    const FeatureLabels labels = rig.see_without_masks(shot);
    const auto& measured = rig.workspace.get<detail::MotionMeasurement>();
    for (std::size_t i = 0; n > 0 && i < labels.size(); ++i) {
      const FeatureMotion& motion = measured.motions[i];
      if (motion.was_tracked() || motion.depth_m > 0 || measured.scratch.was_moving[i]) continue;
      ++unseen;
      EXPECT_FALSE(labels.is_removed(i));
    }
  }
  EXPECT_GT(unseen, 20U);
}

/// Masks miss the rim of a person, and dark cloth and hair have no depth: the wall around them is
/// no reason to take them for the wall.
TEST(MotionBackground, IsNotARimOfAPersonWithoutDepth) {
  Rig rig;
  std::size_t rim = 0, kept = 0;
  for (std::size_t n = 0; n < shots(0.5).size(); ++n) {
    const Shot& shot = shots(0.5)[n];
    FrameView frame = shot.rendered.frame;
    frame.depth = frame.depth.clone();
    cv::Mat inside;
    cv::erode(shot.rendered.moving_mask, inside, cv::Mat::ones(9, 9, CV_8U));
    frame.depth.setTo(0, shot.rendered.moving_mask & ~inside);
    Segmentation masks = shot.rendered.true_segmentation;
    for (Instance& person : masks.instances) {
      cv::Mat eroded;
      cv::erode(person.mask, eroded, cv::Mat::ones(9, 9, CV_8U));
      person.mask = eroded;
    }
    const FeatureLabels labels = rig.see(frame, masks, shot.keypoints);
    for (std::size_t i = 0; n >= 3 && i < labels.size(); ++i) {
      const cv::Point pixel = nearest_pixel(shot.keypoints[i].pt);
      const bool is_person = shot.rendered.moving_mask.at<std::uint8_t>(pixel) != 0;
      if (!is_person || labels[i].reason == Reason::in_mask) continue;
      ++rim;
      kept += labels.is_removed(i) ? 0 : 1;
    }
  }
  EXPECT_GT(rim, 100U);
  EXPECT_LT(20 * kept, rim);
}

/// Returns how many static features are removed for their motion 4 to 15 pixels beside people who
/// walk at a speed.
std::size_t lost_beside_walkers(const MotionJudgeOptions& options, double speed_m_s) {
  Rig rig(options);
  std::size_t lost = 0;
  for (const Shot& shot : shots(speed_m_s)) {
    const FeatureLabels labels = rig.see(shot);
    cv::Mat1f distance;
    cv::distanceTransform(shot.rendered.moving_mask == 0, distance, cv::DIST_L2,
                          cv::DIST_MASK_PRECISE);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const float distance_px = distance(nearest_pixel(shot.keypoints[i].pt));
      const bool is_moving = labels.is_removed(i) && labels[i].reason == Reason::moving;
      lost += is_moving && distance_px >= 4 && distance_px <= 15 ? 1 : 0;
    }
  }
  return lost;
}

/// Tracks beside a person follow him, or fail. The image shows that the wall is where it was. Not
/// so much faster people: what they hid a frame ago no image shows.
TEST(MotionBackground, IsNotLostByItsTracksAlone) {
  MotionJudgeOptions options;
  options.max_thing_depth_m = 100;  // nor does depth tell that it is behind him
  options.fill_radius_px = 0;       // nor do neighbours make it dynamic
  MotionJudgeOptions blind = options;
  blind.max_static_patch_ratio = 0;  // the image tells nothing
  std::size_t lost = 0, lost_blindly = 0;
  for (const double speed_m_s : {0.2, 0.3, 0.4, 0.5}) {
    lost += lost_beside_walkers(options, speed_m_s);
    lost_blindly += lost_beside_walkers(blind, speed_m_s);
  }
  EXPECT_LT(5 * lost, lost_blindly) << lost;
}

}  // namespace
}  // namespace dynfilter::testing
