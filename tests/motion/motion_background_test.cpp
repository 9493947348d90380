// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features that a compensator removed beside a person.

#include <cstddef>
#include <cstdint>
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
/// What compensation took of the wall behind a walker comes back, because motion shows it at rest.
TEST(MotionBackground, ComesBackBesideAWalker) {
  const std::vector<std::size_t> counts = given_back({}, 0.5);
  EXPECT_EQ(counts[0], 0U) << "nothing is known in the first frame";
  for (std::size_t i = 1; i < counts.size(); ++i) EXPECT_GT(counts[i], 20U) << i;
}

}  // namespace
}  // namespace dynfilter::testing
