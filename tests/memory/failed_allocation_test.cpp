// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A failed allocation costs its own frame and nothing else.

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynfilter/plugin.hpp"
#include "support/failing_allocations.hpp"
#include "support/filter_property.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

/// Frame that takes all paths of its rule, chosen by `seed`.
FilterCase busy_case(std::uint64_t seed, CompensationRule rule, int persons) {
  ByteSource source(seed);
  FilterCase input = arbitrary_case(source, {200, 150});
  draw_rule(source, input, rule);
  if (input.frame.depth.empty()) {
    input.frame.depth = arbitrary_depth(source, {200, 150}, false);
    input.frame.metres_per_unit = 1.0 / 5000;
  }
  input.segmentation.instances.clear();
  for (int k = 0; k < persons; ++k) {
    Instance person = Instance::from_box({5 + k, 5, 180, 140});
    person.mask = cv::Mat(60, 60, CV_8UC1, cv::Scalar(255));
    person.mask_origin = {10 + 5 * k, 20};
    input.segmentation.instances.push_back(person);
  }
  for (int i = 0; i < 400; ++i) {
    input.keypoints.emplace_back(static_cast<float>(source.between(-5, 205)),
                                 static_cast<float>(source.between(-5, 155)), 31.0F);
  }
  return input;
}

/// Compares everything that a caller sees of a frame.
void expect_same(const FeatureLabels& labels, const FeatureLabels& expected) {
  ASSERT_EQ(labels.size(), expected.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    ASSERT_TRUE(same_label(labels[i], expected[i])) << "feature " << i;
  }
  EXPECT_EQ(labels.statistics().masked, expected.statistics().masked);
  EXPECT_EQ(labels.statistics().compensated, expected.statistics().compensated);
  EXPECT_EQ(labels.statistics().restored, expected.statistics().restored);
}

class FailedAllocation : public ::testing::TestWithParam<CompensationRule> {
 protected:
  DynamicFilter filter(const FilterCase& input) const {
    DynamicFilterOptions options = input.options;
    options.compensator.rule = GetParam();
    options.feature_floor.floor = 450;
    return DynamicFilter(options);
  }
};

/// Filters a small frame, lets each allocation of a large one fail, and filters other frames.
TEST_P(FailedAllocation, LeavesNoLabelsAndAUsableWorkspace) {
  for (const int persons : {2, 12}) {
    FilterCase small = busy_case(1, GetParam(), 1);
    small.keypoints.resize(70);
    const FilterCase large = busy_case(2, GetParam(), persons);
    FilterCase middle = large;
    middle.keypoints.resize(300);
    const DynamicFilter by = filter(large);
    const FeatureLabels of_large = by.apply(large.frame, large.segmentation, large.keypoints);
    const FeatureLabels of_middle = by.apply(middle.frame, middle.segmentation, middle.keypoints);
    ASSERT_GT(of_large.statistics().masked + of_large.statistics().restored, 0U);
    const std::size_t failed = for_each_failing_allocation([&](std::size_t n) {
      FeatureLabels labels;
      Workspace workspace;
      by.apply(small.frame, small.segmentation, small.keypoints, labels, workspace);
      const bool did_fail = fails_at_allocation(n, [&] {
        by.apply(large.frame, large.segmentation, large.keypoints, labels, workspace);
      });
      if (did_fail) {
        EXPECT_TRUE(labels.empty()) << "after allocation " << n << " failed";
        EXPECT_EQ(labels.statistics().removed() + labels.statistics().features, 0U);
      } else {
        expect_same(labels, of_large);
      }
      by.apply(middle.frame, middle.segmentation, middle.keypoints, labels, workspace);
      expect_same(labels, of_middle);
      by.apply(large.frame, large.segmentation, large.keypoints, labels, workspace);
      expect_same(labels, of_large);
      return did_fail;
    });
    EXPECT_GT(failed, 3U);
  }
}

INSTANTIATE_TEST_SUITE_P(Rules, FailedAllocation,
                         ::testing::Values(CompensationRule::depth, CompensationRule::paper,
                                           CompensationRule::mask));

TEST(FailedAllocationOfKeepStatic, LeavesTheColumnsUnchanged) {
  const FilterCase input = busy_case(3, CompensationRule::mask, 2);
  const FeatureLabels labels =
      DynamicFilter().apply(input.frame, input.segmentation, input.keypoints);
  ASSERT_GT(labels.statistics().removed(), 0U);
  const auto rows = static_cast<int>(labels.size());
  const std::size_t failed = for_each_failing_allocation([&](std::size_t n) {
    std::vector<int> ids(labels.size(), 7);
    cv::Mat descriptors(rows, 32, CV_8UC1, cv::Scalar(5));
    const cv::Mat also_seen_by_others = descriptors;  // shared: rows move in a copy
    const bool did_fail = fails_at_allocation(n, [&] { keep_static(labels, ids, descriptors); });
    EXPECT_EQ(ids.size(), did_fail ? labels.size() : labels.statistics().kept());
    EXPECT_EQ(descriptors.rows, static_cast<int>(ids.size()));
    EXPECT_EQ(also_seen_by_others.rows, rows);
    return did_fail;
  });
  EXPECT_GT(failed, 0U);
}

using PluginAllocations = PluginTest;

/// A host's frame is unchanged if an allocation fails inside Plugin::filter, and the next call is
/// right.
TEST_F(PluginAllocations, FailedOneLeavesTheFrameUnchanged) {
  const HostFrame frame(0);
  HostColumns filtered(frame);
  Plugin(settings())
      .filter(frame.timestamp_s, frame.depth, filtered.keypoints, filtered.descriptors);
  ASSERT_LT(filtered.keypoints.size(), frame.keypoints.size());
  const std::size_t failed = for_each_failing_allocation([&](const std::size_t n) {
    SCOPED_TRACE(n);
    Plugin plugin(settings());
    HostColumns columns(frame);
    const cv::Mat shared = columns.descriptors;  // a second header, so that rows move into a copy
    const auto filter = [&] {
      plugin.filter(frame.timestamp_s, frame.depth, columns.keypoints, columns.descriptors);
    };
    bool is_done = false;
    const bool one_failed = fails_at_allocation(n, [&] {
      try {
        filter();
        is_done = true;
      } catch (const std::runtime_error& error) {  // decoding of an image failed
        EXPECT_NE(std::string(error.what()).find("cannot be"), std::string::npos);
      }
    });
    if (!is_done) {
      expect_equal(columns, HostColumns(frame));
      EXPECT_EQ(plugin.counters().filtered, 0U);
      filter();
    }
    expect_equal(columns, filtered);
    EXPECT_EQ(plugin.counters().filtered, 1U);
    return one_failed && !HasFailure();
  });
  EXPECT_GT(failed, 10U);
}

struct alignas(64) Aligned {
  char bytes[64];
};

TEST(FailingAllocations, EachAllocationOfACallFailsOnce) {
  std::vector<int> steps;
  const std::size_t failed = for_each_failing_allocation([&](const std::size_t n) {
    int step = 0;
    std::vector<int> numbers;  // outside the call, else compilers may remove them
    std::unique_ptr<Aligned> aligned;
    const bool one_failed = fails_at_allocation(n, [&] {
      numbers.resize(10);
      step = 1;
      aligned = std::make_unique<Aligned>();
      step = 2;
      const cv::Mat matrix(4, 4, CV_8UC1);
      step = 3;
    });
    steps.push_back(step);
    return one_failed;
  });
  EXPECT_EQ(failed, 3u);
  EXPECT_EQ(steps, (std::vector<int>{0, 1, 2, 3}));
}

TEST(FailingAllocations, NothingFailsOutsideTheCall) {
  EXPECT_FALSE(
      fails_at_allocation(9, [] { static_cast<void>(cv::Mat(4, 4, CV_8UC1).isContinuous()); }));
  EXPECT_NO_THROW(std::vector<int>(10));
  EXPECT_NO_THROW(cv::Mat(4, 4, CV_8UC1));
}

}  // namespace
}  // namespace dynfilter::testing
