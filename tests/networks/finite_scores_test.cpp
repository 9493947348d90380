// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/finite_scores.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

namespace dynfilter::detail {
namespace {

TEST(FiniteScores, AllowRoundingErrorsOnly) {
  FiniteScores scores;
  constexpr float least = -1e-3F, most = 1 + 1e-3F;
  EXPECT_EQ(scores.probability(least), 0.0F);
  EXPECT_EQ(scores.probability(most), 1.0F);
  EXPECT_EQ(scores.probability(0.25F), 0.25F);
  EXPECT_THROW(scores.probability(std::nextafter(least, -1.0F)), std::runtime_error);
  EXPECT_THROW(scores.probability(std::nextafter(most, 2.0F)), std::runtime_error);
}

TEST(FiniteScores, AreWantedWhereThereAreRows) {
  FiniteScores scores;
  EXPECT_NO_THROW(scores.require_some(0));
  EXPECT_TRUE(std::isnan(scores.probability(std::numeric_limits<float>::infinity())));
  EXPECT_THROW(scores.require_some(1), std::runtime_error);
  scores.probability(0);
  EXPECT_NO_THROW(scores.require_some(1));
}

}  // namespace
}  // namespace dynfilter::detail
