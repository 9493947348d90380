// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/depth_histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using detail::DepthHistogram;

DepthHistogram histogram_of(std::vector<float> depths) {
  return DepthHistogram({depths.data(), depths.size()});
}

/// Adds `count` depths in the middle of the bin of 5 cm that begins at `begin_m`.
void add(std::vector<float>& depths, int count, double begin_m) {
  depths.insert(depths.end(), static_cast<std::size_t>(count), static_cast<float>(begin_m + 0.025));
}

/// Clusters and single depths in the middles of bins, so that no depth lies on an edge.
std::vector<float> arbitrary_depths(ByteSource& source) {
  std::vector<float> depths;
  const int clusters = source.between(1, 5);
  for (int i = 0; i < clusters; ++i) {
    const int first = source.between(0, source.chance(10) ? 1020 : 90);
    const int width = source.between(0, 20);
    const int count = source.between(1, 60);
    for (int j = 0; j < count; ++j) add(depths, 1, 0.05 * source.between(first, first + width));
  }
  return depths;
}

/// Number of depths from `lower` to `upper` within the histogram's range.
int count(const std::vector<float>& depths, double lower, double upper) {
  int sum = 0;
  for (const float depth : depths) {
    sum += depth >= lower && depth < upper && depth < 51.2F ? 1 : 0;
  }
  return sum;
}

double brute_cluster(const std::vector<float>& depths, int half, double share) {
  const auto window = [&](int end) { return count(depths, (end - 2 * half) * 0.05, end * 0.05); };
  const double min_count = share * count(depths, 0, 51.2);
  int fullest = 0;
  for (int end = 0; end <= 1024 + half; ++end) {
    const int here = window(end);
    if (here > window(fullest)) fullest = end;
    bool is_peak = here > 0 && here >= min_count;
    for (int i = -half; is_peak && i <= half; ++i) is_peak = window(end + i) <= here;
    if (is_peak) return (end - half) * 0.05;
  }
  return (fullest - half) * 0.05;
}

TEST(DepthHistogram, NearestClusterMatchesBruteForce) {
  int not_fullest = 0, without_peak = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const std::vector<float> depths = arbitrary_depths(source);
    if (count(depths, 0, 51.2) == 0) continue;
    const int half = source.between(1, 12);
    const double share = source.between(0, 100) / 100.0;
    const double expected = brute_cluster(depths, half, share);
    ASSERT_NEAR(histogram_of(depths).nearest_cluster(half * 0.05, share), expected, 1e-9)
        << "seed " << seed;
    const double fullest = brute_cluster(depths, half, 2);
    not_fullest += expected == fullest ? 0 : 1;
    without_peak +=
        count(depths, fullest - half * 0.05, fullest + half * 0.05) < share * count(depths, 0, 51.2)
            ? 1
            : 0;
  }
  EXPECT_GT(not_fullest, 200);
  EXPECT_GT(without_peak, 200);
}

/// Oracle: extends the range while three adjacent bins, centred on the bin in question, hold
/// enough.
ValueRange brute_extent(const std::vector<float>& depths, double depth, double limit) {
  const double enough = std::max(3.0, 0.015 * count(depths, 0, 51.2));
  const auto end = [&](int direction) {
    const int middle = static_cast<int>(depth / 0.05);
    int bin = middle;
    for (int next = middle + direction; next >= 0 && next < 1024; next += direction) {
      const bool far = (std::abs(next - middle) + 2) * 0.05 > limit + 1e-6;
      if (far || count(depths, (next - 1) * 0.05, (next + 2) * 0.05) < enough) break;
      bin = next;
    }
    return bin;
  };
  return {(end(-1) - 1) * 0.05, (end(+1) + 2) * 0.05};
}

TEST(DepthHistogram, ExtentMatchesBruteForce) {
  int stopped_by_most = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const std::vector<float> depths = arbitrary_depths(source);
    const double depth = double{depths[source.word() % depths.size()]};
    if (depth >= 51.2) continue;
    const double limit = source.between(0, 30) * 0.05;
    const ValueRange expected = brute_extent(depths, depth, limit);
    const ValueRange extent = histogram_of(depths).extent_around(depth, limit);
    ASSERT_NEAR(extent.lower, expected.lower, 1e-9) << "seed " << seed;
    ASSERT_NEAR(extent.upper, expected.upper, 1e-9) << "seed " << seed;
    stopped_by_most += brute_extent(depths, depth, 100).upper > expected.upper ? 1 : 0;
  }
  EXPECT_GT(stopped_by_most, 500);
}

TEST(DepthHistogram, IgnoresDepthsBeyondItsRange) {
  const float beyond[] = {51.2F,
                          52.0F,
                          1e10F,
                          1e30F,
                          std::numeric_limits<float>::max(),
                          std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN()};
  for (const float depth : beyond) {
    EXPECT_EQ(histogram_of({depth, depth, depth}).total(), 0U) << depth;
    EXPECT_EQ(histogram_of({depth, 2.0F, depth}).total(), 1U) << depth;
  }
  EXPECT_EQ(histogram_of({51.1F}).total(), 1U);
  EXPECT_EQ(histogram_of({51.17F, 51.18F, 51.19F, 3.0F}).total(), 4U) << "the last bin";
}

double median_within(std::vector<float> values, double lower, double upper) {
  const detail::DepthSamples depths_m = {values.data(), values.size()};
  return DepthHistogram(depths_m).median_within(depths_m, lower, upper);
}

/// Oracle: sorts the values inside.
double plain_median_within(std::vector<float> values, double lower, double upper) {
  std::sort(values.begin(), values.end());
  std::vector<float> inside;
  for (const float value : values) {
    if (double{value} >= lower && double{value} <= upper) inside.push_back(value);
  }
  return inside.empty() ? 0 : double{inside[inside.size() / 2]};
}

TEST(MedianWithin, MatchesBruteForce) {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    std::vector<float> values(static_cast<std::size_t>(source.between(0, 200)));
    for (float& value : values) {
      value = static_cast<float>(source.between(1, 60)) * (source.chance(50) ? 0.05F : 1.01F);
    }
    const auto end = [&] {
      const double any = source.between(-20, 1400) / 20.0;
      return values.empty() || source.chance(50) ? any
                                                 : double{values[source.word() % values.size()]};
    };
    const double lower = end(), upper = source.chance(90) ? lower + end() : end();
    const double expected = plain_median_within(values, lower, upper);
    ASSERT_EQ(median_within(values, lower, upper), expected) << "seed " << seed;
    found += expected > 0 ? 1 : 0;
  }
  EXPECT_GT(found, 1000U);
}

}  // namespace
}  // namespace dynfilter::testing
