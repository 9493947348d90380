// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_beliefs.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

TEST(MotionBeliefs, AddUpAndStayWithinLimits) {
  const MotionBeliefs beliefs;
  EXPECT_NEAR(beliefs.updated(0, MotionEvidence::supported), 1.4, 1e-12);
  EXPECT_NEAR(beliefs.updated(1.4, MotionEvidence::quiet), 0.46, 1e-12);
  EXPECT_NEAR(beliefs.updated(1, MotionEvidence::seed), 1.1, 1e-12);
  EXPECT_NEAR(beliefs.updated(-2, MotionEvidence::unknown), -1.9, 1e-12);
  EXPECT_EQ(beliefs.updated(3, MotionEvidence::supported), 3);
  EXPECT_EQ(beliefs.updated(-3, MotionEvidence::quiet), -3);
  EXPECT_TRUE(beliefs.is_moving(1.01));
  EXPECT_FALSE(beliefs.is_moving(1));
}

TEST(MotionBeliefs, FollowTheNearestFeature) {
  MotionBeliefs beliefs;
  cv::RNG random(8);
  std::vector<cv::Point2f> points;
  std::vector<double> values;
  for (int i = 0; i < 300; ++i) {
    points.emplace_back(random.uniform(0.0F, 100.0F), random.uniform(0.0F, 100.0F));
    values.push_back(random.uniform(-3.0, 3.0));
  }
  beliefs.remember(points, values);
  for (int i = 0; i < 500; ++i) {
    const cv::Point2f place(random.uniform(-10.0F, 110.0F), random.uniform(-10.0F, 110.0F));
    double nearest = 4, want = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (cv::norm(points[k] - place) >= nearest) continue;
      nearest = cv::norm(points[k] - place);
      want = values[k];
    }
    EXPECT_EQ(beliefs.at(place), want) << place;
  }
  EXPECT_EQ(beliefs.at({NAN, 5}), 0);
  EXPECT_EQ(beliefs.at({1e9F, 5}), 0);
  beliefs.clear();
  EXPECT_EQ(beliefs.at(points[0]), 0);
}

TEST(MotionBeliefs, TakeTheStrongestOfEquallyNearOnes) {
  MotionBeliefs beliefs;
  const std::vector<cv::Point2f> points = {{10, 10}, {10, 10}, {10, 10}};
  std::vector<double> values = {-2, 0.5, 2};
  do {
    beliefs.remember(points, values);
    EXPECT_EQ(beliefs.at({10, 11}), 2);
  } while (std::next_permutation(values.begin(), values.end()));
}

TEST(MotionBeliefs, RefuseNonsense) {
  MotionBeliefOptions options;
  options.min_moving = 4;
  testing::expect_error<std::invalid_argument>([&] { MotionBeliefs{options}; }, "min_moving = 4");
  MotionBeliefs beliefs;
  testing::expect_error<std::invalid_argument>(
      [&] { beliefs.remember(std::vector<cv::Point2f>(2), {1}); }, "1 beliefs and 2 features");
}

}  // namespace
}  // namespace dynfilter
