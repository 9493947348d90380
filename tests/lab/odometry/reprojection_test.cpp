// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/odometry/reprojection.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace odometry {
namespace {

TEST(Huber, IsQuadraticUpToTheLimitAndLinearBeyond) {
  constexpr double limit = 6;
  for (const double squared : {0.0, 0.5, 3.0, 6.0}) {
    EXPECT_EQ(huber(squared, limit).cost, squared);
    EXPECT_EQ(huber(squared, limit).weight, 1);
  }
  // Linear in the residual: 2 * sqrt(limit) * residual - limit.
  EXPECT_NEAR(huber(24, limit).cost, 2 * std::sqrt(limit) * std::sqrt(24) - limit, 1e-12);
  EXPECT_NEAR(huber(24, limit).weight, 0.5, 1e-12);
}

TEST(Huber, WeighsByTheDerivativeOfTheCost) {
  for (double squared = 0.5; squared < 40; squared += 0.7) {
    const double step = 1e-6;
    const double slope =
        (huber(squared + step, 6).cost - huber(squared - step, 6).cost) / (2 * step);
    EXPECT_NEAR(huber(squared, 6).weight, slope, 1e-6) << squared;
  }
}

}  // namespace
}  // namespace odometry
