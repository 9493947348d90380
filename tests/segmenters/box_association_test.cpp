// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "segmenters/propagation/box_association.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

namespace dynfilter::detail {
namespace {

using Matches = std::vector<std::optional<std::size_t>>;

// The second box is half of the first: all numbers are exact.
const cv::Rect2d whole(0, 0, 4, 2), half(0, 0, 2, 2);

TEST(BoxAssociation, OverlapIsCommonOverJointArea) {
  EXPECT_EQ(box_overlap(whole, half), 0.5);
  EXPECT_EQ(box_overlap(half, {1, 0, 2, 2}), 1.0 / 3);
  EXPECT_EQ(box_overlap(half, {2, 0, 2, 2}), 0) << "they touch";
  EXPECT_EQ(box_overlap({}, {}), 0);
}

TEST(BoxAssociation, OverlapsFromTheLeastOnMatch) {
  EXPECT_EQ(associate({{whole}}, {{half}}, 0.5), Matches{0});
  EXPECT_EQ(associate({{whole}}, {{half}}, std::nextafter(0.5, 1)), Matches{std::nullopt});
  EXPECT_EQ(associate({{whole}}, {{{3, 0, 4, 2}}}, 0), Matches{0});
  EXPECT_EQ(associate({{half}}, {{{2, 0, 2, 2}}}, 0), Matches{std::nullopt}) << "they touch";
}

TEST(BoxAssociation, LargestOverlapWinsThenLowestIndex) {
  const cv::Rect2d quarter(0, 0, 1, 2);
  EXPECT_EQ(associate({{quarter}, {half}}, {{whole}}, 0), (Matches{std::nullopt, 0}));
  EXPECT_EQ(associate({{half}, {half}}, {{whole}, {whole}}, 0), (Matches{0, 1}));
  EXPECT_EQ(associate({{half}}, {{quarter}, {whole}, {half}}, 0), Matches{2});
}

TEST(BoxAssociation, OnlyFreeBoxesOfOneClassMatch) {
  EXPECT_EQ(associate({{half, 1}}, {{half, 2}}, 0), Matches{std::nullopt});
  EXPECT_EQ(associate({{half, 1, false}}, {{half, 1}}, 0), Matches{std::nullopt});
  EXPECT_EQ(associate({{half, 1}}, {{half, 1, false}}, 0), Matches{std::nullopt});
}

}  // namespace
}  // namespace dynfilter::detail
