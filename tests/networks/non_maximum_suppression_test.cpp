// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/non_maximum_suppression.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace dynfilter {
namespace {

using detail::Box;
using detail::Candidate;
using detail::intersection_over_union;

// The second box is half of the first: all numbers are exact.
constexpr Box whole{0, 0, 4, 2}, half{0, 0, 2, 2};

TEST(NonMaximumSuppression, OverlapIsCommonOverJointArea) {
  EXPECT_EQ(intersection_over_union(whole, half), 0.5F);
  EXPECT_EQ(intersection_over_union(half, {1, 0, 3, 2}), 1.0F / 3);
  EXPECT_EQ(intersection_over_union(whole, whole), 1.0F);
  EXPECT_EQ(intersection_over_union(half, {2, 0, 4, 2}), 0.0F) << "they touch";
  EXPECT_EQ(intersection_over_union(half, {3, 3, 4, 4}), 0.0F) << "they are apart in both axes";
  EXPECT_EQ(intersection_over_union({1, 1, 1, 1}, {1, 1, 1, 1}), 0.0F) << "they have no area";
}

TEST(NonMaximumSuppression, OnlyOverlapsAboveTheThresholdSuppress) {
  const std::vector<Candidate> candidates = {{0, 0.9F, 0, whole}, {0, 0.8F, 1, half}};
  const float below = std::nextafter(0.5F, 0.0F);
  EXPECT_EQ(suppress_greedily(candidates, 0.5F).size(), 2U);
  EXPECT_EQ(suppress_greedily(candidates, below).size(), 1U);
  EXPECT_EQ(suppress_fast(candidates, 0.5F, 10).size(), 2U);
  EXPECT_EQ(suppress_fast(candidates, below, 10).size(), 1U);
}

TEST(NonMaximumSuppression, FastSuppressionTakesTheBestOfEachClass) {
  std::vector<Candidate> candidates;
  for (int i = 0; i < 6; ++i) {
    const auto left = 10 * static_cast<float>(i);
    candidates.push_back({i % 2, 0.5F + 0.05F * static_cast<float>(i), i, {left, 0, left + 4, 2}});
  }
  std::vector<int> rows;
  for (const Candidate& kept : suppress_fast(candidates, 0.5F, 2)) rows.push_back(kept.row);
  EXPECT_EQ(rows, (std::vector<int>{5, 4, 3, 2}));
}

}  // namespace
}  // namespace dynfilter
