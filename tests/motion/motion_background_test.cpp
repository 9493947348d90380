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

}  // namespace
}  // namespace dynfilter::testing
