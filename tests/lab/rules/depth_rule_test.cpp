// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/level_scenes.hpp"
#include "support/filter_property.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// With fresh and stale masks, and with depths of features in place of the image.
TEST(DepthRule, MatchesTheOracleOnRenderedFrames) {
  std::size_t compensated = 0, restored = 0, cautious = 0;
  for (const std::string level : {"medium", "desk", "near_crowd"}) {
    for (const int mask_age : {0, 6}) {
      FilterCase input;
      input.frame = level_frame(level, 40).frame;
      input.segmentation = level_frame(level, 40 - mask_age).poor_segmentation;
      input.depths_m.emplace();
      for (int y = 1; y < 120; y += 3) {
        for (int x = 1; x < 160; x += 3) {
          input.keypoints.emplace_back(cv::Point(x, y), 31.0F);
          input.depths_m->push_back(static_cast<float>(input.frame.depth_m({x, y}).value_or(0)));
        }
      }
      for (const bool has_image : {true, false}) {
        if (!has_image) input.frame.depth = cv::Mat();
        ASSERT_EQ(check_filter(input), "") << level << ", " << mask_age << ", " << has_image;
        const FrameStatistics statistics =
            DynamicFilter(input.options)
                .apply(input.frame, input.segmentation, input.features())
                .statistics();
        compensated += statistics.compensated;
        restored += statistics.restored;
        cautious += statistics.was_cautious() ? 1 : 0;
      }
    }
  }
  EXPECT_GT(compensated, 3000U);
  EXPECT_GT(restored, 700U);
  EXPECT_GT(cautious, 0U);
}

}  // namespace
}  // namespace dynfilter::testing
