// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/frame_features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "support/filter_case.hpp"

namespace dynfilter::testing {
namespace {

using Indices = std::vector<std::size_t>;

Indices sorted(const FeatureIndices& found) {
  Indices indices(found.begin(), found.end());
  std::sort(indices.begin(), indices.end());
  return indices;
}

/// Tests each feature, in double precision.
Indices brute_inside(const std::vector<cv::KeyPoint>& keypoints, const cv::Rect& box) {
  Indices indices;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const cv::Point pixel = nearest_pixel(keypoints[i].pt);
    const double x = double{1} * pixel.x - box.x, y = double{1} * pixel.y - box.y;
    if (x >= 0 && y >= 0 && x < box.width && y < box.height) indices.push_back(i);
  }
  return indices;
}

cv::Rect arbitrary_box(ByteSource& source, const cv::Size& image) {
  constexpr int int_max = std::numeric_limits<int>::max(),
                int_min = std::numeric_limits<int>::min();
  cv::Rect box(source.between(-9, image.width), source.between(-9, image.height),
               source.between(0, image.width), source.between(0, image.height));
  if (source.chance(3)) box.x = int_max;
  if (source.chance(3)) box.y = int_min;
  if (source.chance(3)) box.width = int_max;
  if (source.chance(3)) box = {int_min, int_min, int_max, int_max};
  if (source.chance(3)) box = {0, 0, int_max, int_max};
  return box;
}

TEST(FrameFeatures, InsideMatchesBruteForce) {
  FrameFeatures features;  // keeps what earlier frames left in it
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const int max_side = source.chance(10) ? 60000 : 900;
    const cv::Size image(source.between(1, max_side), source.between(1, max_side));
    const std::vector<cv::KeyPoint> keypoints = arbitrary_keypoints(source, image);
    features.read(keypoints);
    ASSERT_EQ(features.size(), keypoints.size());
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      ASSERT_EQ(features.pixel(i), nearest_pixel(keypoints[i].pt));
    }
    for (int k = 0; k < 10; ++k) {
      const cv::Rect box = arbitrary_box(source, image);
      const Indices expected = brute_inside(keypoints, box);
      ASSERT_EQ(sorted(features.inside(box)), expected) << "seed " << seed << ", " << box;
      found += expected.size();
    }
  }
  EXPECT_GT(found, 100000U);
}

TEST(FrameFeatures, GrownBoundsDoNotOverflow) {
  FrameFeatures features;
  const std::vector<cv::Point2f> points = {{5, 5}, {2147483520.0F, 5}};
  {
    features.read(points);
    const cv::Rect far_right(std::numeric_limits<int>::max(), 0, 10, 10);
    EXPECT_EQ(sorted(features.inside(detail::bounds_of(far_right, 200))), Indices{1});
    EXPECT_EQ(features.inside(detail::bounds_of(far_right, std::int64_t{1} << 40)).size(), 2U);
    EXPECT_TRUE(features.inside(detail::bounds_of(cv::Rect(5, 5, 0, 0))).empty());
    EXPECT_TRUE(features.inside(far_right).empty());
  }
}

TEST(FrameFeatures, KeptAndRemovedInsideMatchTheLabels) {
  FrameFeatures features;
  std::size_t kept = 0, removed = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const cv::Size image(source.between(1, 900), source.between(1, 900));
    const std::vector<cv::KeyPoint> keypoints = arbitrary_keypoints(source, image);
    const int instances = source.between(1, 12);
    Segmentation segmentation;
    segmentation.instances.assign(static_cast<std::size_t>(instances), Instance());
    FeatureLabels labels(keypoints.size(), segmentation);
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const Reason reason = source.chance(60) ? Reason::in_mask : Reason::compensated;
      if (source.chance(60)) labels.remove(i, source.between(-1, instances - 1), reason, 1);
      if (source.chance(10)) labels.restore(i);
    }
    features.read(keypoints);
    const cv::Rect box = arbitrary_box(source, image);
    for (int k = 0; k < instances; ++k) {
      Indices expected_kept, expected_removed;
      for (const std::size_t i : brute_inside(keypoints, box)) {
        if (!labels[i].removed) expected_kept.push_back(i);
        const bool is_masked = labels[i].removed && labels[i].reason == Reason::in_mask;
        if (is_masked && labels[i].instance == k) expected_removed.push_back(i);
      }
      ASSERT_EQ(sorted(features.kept_inside(box, labels)), expected_kept) << "seed " << seed;
      ASSERT_EQ(sorted(features.removed_inside(box, labels, static_cast<std::size_t>(k),
                                               Reason::in_mask)),
                expected_removed)
          << "seed " << seed << ", instance " << k;
      kept += expected_kept.size();
      removed += expected_removed.size();
    }
  }
  EXPECT_GT(kept, 10000U);
  EXPECT_GT(removed, 1000U);
}

/// A crowd's features lie in many small cells, a few features in a few large ones.
TEST(FrameFeatures, CellsFitTheNumberOfFeatures) {
  FrameFeatures features;
  for (const int count : {0, 1, 40, 3000, 20000}) {
    ByteSource source(static_cast<std::uint64_t>(count));
    std::vector<cv::KeyPoint> keypoints;
    for (int i = 0; i < count; ++i) {
      keypoints.emplace_back(static_cast<float>(source.between(0, 1919)),
                             static_cast<float>(source.between(0, 1079)), 1.0F);
    }
    features.read(keypoints);
    for (const cv::Rect& box : {cv::Rect(0, 0, 1920, 1080), cv::Rect(700, 300, 90, 200),
                                cv::Rect(1919, 1079, 1, 1), cv::Rect(-5, 500, 6, 700)}) {
      ASSERT_EQ(sorted(features.inside(box)), brute_inside(keypoints, box)) << count << ", " << box;
    }
  }
}

TEST(FrameFeatures, AreReadOnceForAllStagesAndAgainForOthers) {
  std::vector<cv::Point2f> points = {{1, 1}, {2, 2}};
  const std::vector<cv::Point2f> others = {{7, 7}};
  Workspace workspace;
  {
    const FrameFeatures::Reading reading(workspace.get<FrameFeatures>(), points);
    EXPECT_TRUE(workspace.get<FrameFeatures>().keeps(points));
    EXPECT_EQ(frame_features(points, workspace).pixel(0), cv::Point(1, 1));
    EXPECT_EQ(frame_features(others, workspace).pixel(0), cv::Point(7, 7));
    EXPECT_FALSE(workspace.get<FrameFeatures>().keeps(points)) << "others were read over them";
    EXPECT_EQ(frame_features(points, workspace).pixel(1), cv::Point(2, 2));
  }
  points[0] = {5, 5};  // of the next frame, in the same memory
  EXPECT_EQ(frame_features(points, workspace).pixel(0), cv::Point(5, 5));
}

}  // namespace
}  // namespace dynfilter::testing
