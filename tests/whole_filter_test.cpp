// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <gtest/gtest.h>

#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

TEST(WholeFilter, EqualsTheOracleOnArbitraryInput) {
  std::size_t masked = 0, compensated = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    const FrameStatistics statistics = DynamicFilter(input.options)
                                           .apply(input.frame, input.segmentation, input.keypoints)
                                           .statistics();
    masked += statistics.masked;
    compensated += statistics.compensated;
    kept += statistics.kept();
  }
  // The comparison means something only if all three happen a lot.
  EXPECT_GT(masked, 100000U);
  EXPECT_GT(compensated, 5000U);
  EXPECT_GT(kept, 10000U);
}

}  // namespace
}  // namespace dynfilter::testing
