// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/range_estimator.hpp"

#include <gtest/gtest.h>

#include "support/oracle.hpp"

namespace dynfilter::testing {
namespace {

ValueRange range_of(std::vector<double> values, const RangeEstimatorOptions& options = {}) {
  return RangeEstimator(options).estimate(values);
}

TEST(ValueRange, HoldsItsEndsAndMayBeASingleValue) {
  const ValueRange single = {2.5, 2.5};
  EXPECT_FALSE(single.empty());
  EXPECT_TRUE(single.contains(2.5));
  EXPECT_FALSE(single.contains(std::nextafter(2.5, 3)));
  EXPECT_FALSE(single.contains(std::nextafter(2.5, 2)));
  EXPECT_TRUE(ValueRange().empty());
  EXPECT_FALSE(ValueRange().contains(0));
}

TEST(RangeEstimator, MatchesTheOracleOnArbitraryValues) {
  for (std::uint64_t seed = 0; seed < 5000; ++seed) {
    ByteSource source(seed);
    const RangeEstimatorOptions options =
        arbitrary_range_options(source, source.between(0, 8) / 16.0);
    const int distinct = source.between(1, 40);
    std::vector<double> values(static_cast<std::size_t>(source.between(0, 30)));
    for (double& value : values) value = source.between(-distinct, distinct) / 7.0;
    const ValueRange expected = oracle_range(values, options);
    const ValueRange got = range_of(values, options);
    ASSERT_EQ(got.empty(), expected.empty()) << "seed " << seed;
    if (expected.empty()) continue;
    ASSERT_EQ(got.lower, expected.lower) << "seed " << seed;
    ASSERT_EQ(got.upper, expected.upper) << "seed " << seed;
  }
}

TEST(RangeEstimator, RejectsAFarBackgroundDepth) {
  const ValueRange range = range_of({1.5, 1.52, 1.48, 1.55, 1.5, 1.46, 4.2});
  EXPECT_EQ(range.lower, 1.46);
  EXPECT_EQ(range.upper, 1.55);
}

/// The median is 1.5 and the MAD is 0, because more than half the values are equal. The mean
/// deviation then gives the limit 0.1 x 2 / 9 x 1.2533 x 3 = 0.084, so 1.6 and 1.4 are outliers.
TEST(RangeEstimator, FallsBackToTheMeanDeviationIfTheMadIsZero) {
  const ValueRange range = range_of({1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.6, 1.4});
  EXPECT_EQ(range.lower, 1.5);
  EXPECT_EQ(range.upper, 1.5);
  EXPECT_EQ(range_of({2, 2, 2, 2, 2}).upper, 2);  // no deviation at all: none is an outlier
}

TEST(RangeEstimator, SupportsTukeysFences) {
  RangeEstimatorOptions options;
  options.outlier_rule = OutlierRule::interquartile_range;
  options.outlier_factor = 1.5;
  // Quartiles 2 and 4, fences -1 and 7.
  const ValueRange range = range_of({1, 2, 3, 4, 7.001}, options);
  EXPECT_EQ(range.lower, 1);
  EXPECT_EQ(range.upper, 4);
  EXPECT_EQ(range_of({1, 2, 3, 4, 7}, options).upper, 7);
}

TEST(RangeEstimator, HasNoRangeForFewValues) {
  EXPECT_TRUE(range_of({1, 2, 3, 4}).empty());
  EXPECT_FALSE(range_of({1, 2, 3, 4, 5}).empty());
  EXPECT_TRUE(range_of({}).empty());
}

/// A factor below 1 may reject all values: two groups with the median between them.
TEST(RangeEstimator, HasNoRangeIfAllAreOutliers) {
  RangeEstimatorOptions options;
  options.outlier_factor = 0.25;
  EXPECT_TRUE(range_of({1, 1, 1, 9, 9, 9}, options).empty());
}

}  // namespace
}  // namespace dynfilter::testing
