// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/sample_lanes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using detail::InstructionSet;
using detail::LaneRow;

class SampleLanesBySet : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(SampleLanesBySet, AreSortedEachForItself) {
  for (std::size_t count = 0; count < 150; ++count) {
    ByteSource source(count);
    std::vector<LaneRow> rows(count);
    for (LaneRow& row : rows) {
      // Small ones, of which many are equal, and all that there are.
      for (std::uint32_t& number : row) number = source.word() >> (source.chance(50) ? 29U : 0U);
    }
    std::vector<LaneRow> sorted = rows;
    detail::sort_lanes(sorted.data(), count, GetParam());
    for (std::size_t lane = 0; lane < detail::sample_lanes; ++lane) {
      std::vector<std::uint32_t> expected, got;
      for (const LaneRow& row : rows) expected.push_back(row[lane]);
      for (const LaneRow& row : sorted) got.push_back(row[lane]);
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(got, expected) << count << " numbers, lane " << lane;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, SampleLanesBySet,
                         ::testing::ValuesIn(detail::supported_instruction_sets()));

/// Of different lengths, in memory that was used before.
TEST(SampleLanes, GiveBackWhatWasAddedInOrder) {
  std::vector<LaneRow> memory;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    ByteSource source(seed);
    constexpr std::size_t most = 20;
    detail::SampleLanes lanes(memory, most);
    std::vector<double> expected[detail::sample_lanes];
    for (std::size_t lane = 0; lane < detail::sample_lanes; ++lane) {
      const int steps = source.between(0, most);
      for (int i = 0; i < steps; ++i) {
        const bool is_wanted = source.chance(70);
        const std::uint32_t number = source.word() % 1000;
        lanes.add_if(is_wanted, lane, number);
        if (is_wanted) expected[lane].push_back(number / 8.0);
      }
      std::sort(expected[lane].begin(), expected[lane].end());
    }
    lanes.sort(detail::best_instruction_set());
    for (std::size_t lane = 0; lane < detail::sample_lanes; ++lane) {
      std::vector<double> got(3);
      lanes.transform(lane, got, [](std::uint32_t number) { return number / 8.0; });
      ASSERT_EQ(lanes.size(lane), expected[lane].size());
      ASSERT_EQ(got, expected[lane]) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
