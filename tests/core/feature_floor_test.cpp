// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/feature_floor.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace dynfilter::testing {
namespace {

FeatureLabels floored(std::size_t features, std::size_t removed, std::size_t floor) {
  Segmentation segmentation;
  segmentation.image_size = {800, 600};
  segmentation.instances.resize(1);
  const std::vector<cv::Point2f> points(features);
  FeatureLabels labels(features, segmentation);
  for (std::size_t i = 0; i < removed; ++i) labels.remove(i, 0, Reason::in_mask, 0.9F);
  FeatureFloor({floor})({FrameView(), segmentation, points}, labels);
  return labels;
}

TEST(FeatureFloor, ReportsStarvationAndChangesNoLabel) {
  const FeatureLabels enough = floored(10, 4, 6);
  EXPECT_FALSE(enough.statistics().starved);
  EXPECT_EQ(enough.statistics().suggested_features, 0U);
  const FeatureLabels starved = floored(10, 6, 5);
  EXPECT_TRUE(starved.statistics().starved);
  EXPECT_EQ(starved.statistics().kept(), 4U);
  EXPECT_EQ(starved.statistics().suggested_features, 13U);  // 5 / 0.4
  EXPECT_EQ(floored(10, 10, 5).statistics().suggested_features, 40U)
      << "at most four times as many";
}

}  // namespace
}  // namespace dynfilter::testing
