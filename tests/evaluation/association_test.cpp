// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/association.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Oracle: repeatedly takes the best pair of unused times until none is within the limit.
Pairs associate_by_search(const std::vector<double>& a, const std::vector<double>& b,
                          double max_difference_s) {
  const auto micro = [](double s) { return std::llround(s * 1e6); };
  std::vector<bool> a_used(a.size()), b_used(b.size());
  Pairs pairs;
  while (true) {
    auto best = std::make_tuple(micro(max_difference_s) + 1, 0LL, 0LL);
    std::pair<std::size_t, std::size_t> found(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        if (a_used[i] || b_used[j]) continue;
        const auto candidate =
            std::make_tuple(std::abs(micro(a[i]) - micro(b[j])), micro(a[i]), micro(b[j]));
        if (candidate < best) {
          best = candidate;
          found = {i, j};
        }
      }
    }
    if (found.first == a.size()) break;
    a_used[found.first] = b_used[found.second] = true;
    pairs.push_back(found);
  }
  std::sort(pairs.begin(), pairs.end(),
            [&](const auto& p, const auto& q) { return a[p.first] < a[q.first]; });
  return pairs;
}

std::vector<double> random_times(std::mt19937& random, int count, double step) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    // A coarse grid makes ties.
    const double time = 1341846434 + step * static_cast<double>(random() % 200);
    if (std::find(times.begin(), times.end(), time) == times.end()) times.push_back(time);
  }
  return times;
}

TEST(Associate, MatchesBruteForce) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 300; ++trial) {
    const double step = trial % 2 == 0 ? 0.005 : 0.000733;
    const auto a = random_times(random, static_cast<int>(random() % 30), step);
    const auto b = random_times(random, static_cast<int>(random() % 30), step);
    const double limit = trial % 5 == 0 ? 0 : 0.02;
    EXPECT_EQ(associate(a, b, limit), associate_by_search(a, b, limit)) << "trial " << trial;
  }
}

TEST(Associate, PicksTheBestPairFirst) {
  // 1.010 is nearer to the depth than 1.000 is, which then gets no partner.
  EXPECT_EQ(associate({1.000, 1.010}, {1.011}, 0.02), (Pairs{{1, 0}}));
  // A tie goes to the earlier time of the first list, then of the second.
  EXPECT_EQ(associate({1.02, 1.00}, {1.01}, 0.02), (Pairs{{1, 0}}));
  EXPECT_EQ(associate({1.01}, {1.02, 1.00}, 0.02), (Pairs{{0, 1}}));
}

TEST(Associate, RefusesInvalidTimesAndLimits) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_error<std::invalid_argument>([&] { associate({nan}, {1}, 0.02); }, "finite times");
  expect_error<std::invalid_argument>([&] { associate({1}, {1.4e18}, 0.02); }, "in seconds");
  expect_error<std::invalid_argument>([&] { associate({1}, {1}, -1); }, "max_difference_s = -1");
  expect_error<std::invalid_argument>([&] { associate({1}, {1}, nan); }, "max_difference_s = nan");
  EXPECT_TRUE(associate({}, {}, 0.02).empty());
}

}  // namespace
}  // namespace dynfilter::testing
