// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/frame_features.hpp"

#include "support/filter_case.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using Indices = std::vector<std::size_t>;

Indices sorted(const FrameFeatures::Inside& found) {
  Indices indices;
  for (const std::uint32_t i : found) indices.push_back(i);
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
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
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
  EXPECT_GT(found, 30000U);
}

TEST(FrameFeatures, GrownBoundsDoNotOverflow) {
  FrameFeatures features;
  const std::vector<cv::Point2f> points = {{5, 5}, {2147483520.0F, 5}};
  features.read(points);
  const cv::Rect far_right(std::numeric_limits<int>::max(), 0, 10, 10);
  const auto within = [&](std::int64_t margin) {
    return sorted(features.inside(detail::bounds_of(far_right, margin)));
  };
  EXPECT_EQ(within(200), Indices{1});
  EXPECT_EQ(within(std::int64_t{1} << 40), (Indices{0, 1}));
  EXPECT_EQ(within(0), Indices());
  EXPECT_EQ(sorted(features.inside(cv::Rect(5, 5, 0, 0))), Indices());
}

/// A query in the loop over another one changes neither answer.
TEST(FrameFeatures, QueriesNest) {
  std::vector<cv::Point2f> points;
  for (int i = 0; i < 10; ++i) points.emplace_back(static_cast<float>(10 * i), 5.0F);
  FrameFeatures features;
  features.read(points);
  Indices outer, inner;
  for (const std::uint32_t i : features.inside(cv::Rect(0, 0, 60, 10))) {
    outer.push_back(i);
    const cv::Rect around(10 * static_cast<int>(i) - 15, 0, 31, 10);
    for (const std::uint32_t j : features.inside(around)) inner.push_back(j);
  }
  std::sort(outer.begin(), outer.end());
  EXPECT_EQ(outer, (Indices{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(inner.size(), 2U + 5 * 3U);
}

}  // namespace
}  // namespace dynfilter::testing
