// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "toy.hpp"

#include <gtest/gtest.h>

TEST(Toy, ComparesAndCounts) {
  EXPECT_TRUE(is_below(1, 2));
  EXPECT_FALSE(is_below(2, 2));
  EXPECT_EQ(not_negative(-1), 0);
  EXPECT_EQ(not_negative(3), 3);
  EXPECT_EQ(last_index(5), 4);
  EXPECT_EQ(checked(7), 7);
  EXPECT_EQ(checked(100), 100);
  EXPECT_EQ(checked(200), 100);
}

// Does not notice a mutant: the negative of 0 is 0, so that `number <= 0` changes nothing.
TEST(Toy, HasAnAbsoluteValue) {
  EXPECT_EQ(absolute(-2), 2);
  EXPECT_EQ(absolute(2), 2);
  EXPECT_EQ(absolute(0), 0);
}
