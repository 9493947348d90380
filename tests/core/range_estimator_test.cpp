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

}  // namespace
}  // namespace dynfilter::testing
