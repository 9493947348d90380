// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Properties of the whole filter. Its labels are compared with an oracle in whole_filter_test.cpp.

#include "dynfilter/dynamic_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <thread>

#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

FeatureLabels filtered(const FilterCase& input) {
  return DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
}

TEST(DynamicFilter, PermutingTheFeaturesPermutesTheLabels) {
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source);
    const FeatureLabels before = filtered(input);
    std::vector<std::size_t> order(input.keypoints.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (std::size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[source.word() % i]);
    }
    const std::vector<cv::KeyPoint> keypoints = input.keypoints;
    for (std::size_t i = 0; i < order.size(); ++i) input.keypoints[i] = keypoints[order[i]];
    const FeatureLabels after = filtered(input);
    for (std::size_t i = 0; i < order.size(); ++i) {
      ASSERT_TRUE(same_label(after[i], before[order[i]])) << "seed " << seed << ", feature " << i;
    }
  }
}

/// The same small picture at two places of a large one that is empty otherwise.
FilterCase placed_at(const FilterCase& small, cv::Point offset) {
  FilterCase large = small;
  large.options.mask_culler.static_mask = cv::Mat();
  large.segmentation.image_size = {100, 100};
  if (!small.frame.depth.empty()) {
    large.frame.depth = cv::Mat::zeros(100, 100, small.frame.depth.type());
    small.frame.depth.copyTo(large.frame.depth(cv::Rect(offset, small.frame.depth.size())));
  }
  for (Instance& instance : large.segmentation.instances) {
    instance.box.x += offset.x;
    instance.box.y += offset.y;
    instance.mask_origin += offset;
  }
  for (cv::KeyPoint& keypoint : large.keypoints) keypoint.pt += cv::Point2f(offset);
  return large;
}

TEST(DynamicFilter, MovingEverythingByWholePixelsChangesNothing) {
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    ByteSource source(seed);
    const FilterCase small = arbitrary_case(source);
    const auto out_of_reach = [](const Instance& instance) {
      return std::abs(double{1} * instance.box.x) > 1000;  // at the ends of int: cannot be moved
    };
    const auto& instances = small.segmentation.instances;
    if (std::any_of(instances.begin(), instances.end(), out_of_reach)) continue;
    const FeatureLabels here = filtered(placed_at(small, {30, 30}));
    const FeatureLabels there = filtered(placed_at(small, {53, 41}));
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (std::abs(small.keypoints[i].pt.x) > 1000 || std::isnan(small.keypoints[i].pt.x)) continue;
      ASSERT_TRUE(same_label(here[i], there[i])) << "seed " << seed << ", feature " << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 20000);
}

TEST(DynamicFilter, IsTheSameFromAnyThreadInAnyOrder) {
  constexpr std::size_t cases = 200;
  std::vector<FilterCase> inputs;
  for (std::uint64_t seed = 0; seed < cases; ++seed) {
    ByteSource source(seed);
    inputs.push_back(arbitrary_case(source));
    inputs.back().options = inputs.front().options;
    inputs.back().options.mask_culler.static_mask = cv::Mat();
  }
  const DynamicFilter filter(inputs[0].options);
  const auto run = [&](std::size_t i, FeatureLabels& labels, Workspace& workspace) {
    filter.apply(inputs[i].frame, inputs[i].segmentation, inputs[i].keypoints, labels, workspace);
  };
  std::vector<FeatureLabels> forwards(cases), backwards(cases);
  std::thread first([&] {
    Workspace workspace;
    for (std::size_t i = 0; i < cases; ++i) run(i, forwards[i], workspace);
  });
  std::thread second([&] {
    Workspace workspace;
    for (std::size_t i = cases; i-- > 0;) run(i, backwards[i], workspace);
  });
  first.join();
  second.join();
  for (std::size_t i = 0; i < cases; ++i) {
    for (std::size_t j = 0; j < forwards[i].size(); ++j) {
      ASSERT_TRUE(same_label(forwards[i][j], backwards[i][j])) << "case " << i << ", feature " << j;
    }
  }
}

TEST(DynamicFilter, ALargerExpansionNeverLosesACompensatedFeature) {
  std::size_t gained = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source);
    const FeatureLabels before = filtered(input);
    input.options.edge_compensator.depth.expansion += 0.3;
    input.options.edge_compensator.code.expansion += 20;
    const FeatureLabels after = filtered(input);
    for (std::size_t i = 0; i < before.size(); ++i) {
      ASSERT_TRUE(after.is_removed(i) || !before.is_removed(i)) << "seed " << seed;
    }
    gained += after.statistics().compensated - before.statistics().compensated;
  }
  EXPECT_GT(gained, 100U) << "the property would hold of a filter that ignores its options";
}

TEST(DynamicFilter, TakesPointsAsWellAsKeypoints) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source);
    input.options.mask_culler.margin_per_diameter = 0;
    std::vector<cv::Point2f> points;
    for (const cv::KeyPoint& keypoint : input.keypoints) points.push_back(keypoint.pt);
    const FeatureLabels of_keypoints = filtered(input);
    const FeatureLabels of_points =
        DynamicFilter(input.options).apply(input.frame, input.segmentation, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_TRUE(same_label(of_keypoints[i], of_points[i])) << "seed " << seed;
    }
  }
}

TEST(DynamicFilter, TwoFiltersInOneProcessShareNothing) {
  ByteSource source(3);
  FilterCase input = arbitrary_case(source);
  const FeatureLabels alone = filtered(input);
  FilterCase other = input;
  other.options.mask_culler.dynamic_classes = {0, 1, 2, 3};
  other.options.edge_compensator.seed += 1;
  const DynamicFilter first(input.options), second(other.options);
  for (int round = 0; round < 3; ++round) {
    second.apply(other.frame, other.segmentation, other.keypoints);
    const FeatureLabels again = first.apply(input.frame, input.segmentation, input.keypoints);
    for (std::size_t i = 0; i < alone.size(); ++i) ASSERT_TRUE(same_label(alone[i], again[i]));
  }
}

}  // namespace
}  // namespace dynfilter::testing
