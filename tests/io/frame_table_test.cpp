// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "io/frame_table.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

std::ptrdiff_t cells_of(const std::string& row) {
  return std::count(row.begin(), row.end(), ',') + 1;
}

TEST(FrameTable, HasACellForEachColumnInTheirOrder) {
  FrameStatistics statistics;
  statistics.has_segmentation = true;
  statistics.segmentation_age_s = 0.25;
  statistics.features = 100;
  statistics.masked = 20;
  statistics.compensated = 10;
  statistics.moving = 5;
  statistics.custom = 4;
  statistics.restored = 3;
  statistics.starved = true;
  statistics.suggested_features = 1500;
  statistics.instances.resize(4);
  statistics.instances[0].compensation = Compensation::no_depth_image;
  statistics.instances[1].compensation = Compensation::too_few_samples;
  statistics.instances[2].compensation = Compensation::no_depth_image;
  statistics.instances[3].compensation = Compensation::cautious;
  statistics.motion.outcome = MotionOutcome::applied;
  statistics.motion.given_back = 2;
  const std::string row = detail::frame_cells("7", 1.5, statistics);
  EXPECT_EQ(row, "7,1.500000,1,0.250000,4,100,20,10,5,4,3," + std::to_string(statistics.kept()) +
                     ",1,1500,2,1,1,applied,2");
  EXPECT_EQ(cells_of(row), cells_of(detail::frame_columns()));
}

}  // namespace
}  // namespace dynfilter::testing
