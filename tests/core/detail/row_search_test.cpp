// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/row_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <random>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {
namespace {

constexpr int radius = RowSearch::radius;

int rounded_mean(const cv::Mat1b& image, cv::Point pixel) {
  int sum = 0, count = 0;
  for (int v = -radius; v <= radius; ++v) {
    for (int u = -radius; u <= radius; ++u, ++count) sum += image(pixel.y + v, pixel.x + u);
  }
  return (sum + count / 2) / count;
}

int difference(const cv::Mat1b& a, cv::Point at, const cv::Mat1b& b, cv::Point place) {
  const int mean_a = rounded_mean(a, at), mean_b = rounded_mean(b, place);
  int sum = 0;
  for (int v = -radius; v <= radius; ++v) {
    for (int u = -radius; u <= radius; ++u) {
      sum += std::abs((a(at.y + v, at.x + u) - mean_a) - (b(place.y + v, place.x + u) - mean_b));
    }
  }
  return sum;
}

/// The rule, as plainly as possible.
std::optional<RowSearch::Match> find_plainly(const cv::Mat1b& from, cv::Point pixel,
                                             const cv::Mat1b& to, int first_x, int last_x,
                                             double min_distinction) {
  first_x = std::max(first_x, radius);
  last_x = std::min(last_x, to.cols - 1 - radius);
  if (last_x - first_x < 2) return {};
  std::vector<int> differences;
  for (int x = first_x; x <= last_x; ++x) {
    differences.push_back(difference(from, pixel, to, {x, pixel.y}));
  }
  int best = 0;
  const int count = static_cast<int>(differences.size());
  const auto at = [&](int i) { return differences[static_cast<std::size_t>(i)]; };
  for (int i = 0; i < count; ++i) best = at(i) < at(best) ? i : best;
  if (best == 0 || best == count - 1) return {};
  for (int i = 0; i < count && min_distinction > 0; ++i) {
    if (std::abs(i - best) > 2 && at(i) <= min_distinction * at(best)) return {};
  }
  const int bend = at(best - 1) + at(best + 1) - 2 * at(best);
  const double fraction = bend > 0 ? 0.5 * (at(best - 1) - at(best + 1)) / bend : 0;
  return RowSearch::Match{first_x + best + fraction, at(best)};
}

/// A noisy row pattern that may repeat itself, and another view of it.
struct Pair {
  cv::Mat1b from, to;
};

Pair random_pair(std::mt19937& random, int width) {
  const auto below = [&](int end) {
    return static_cast<int>(random() % static_cast<unsigned>(end));
  };
  const int period = below(3) == 0 ? width : 5 + below(20);
  const int noise = 1 + below(40), shift = below(8), brighter = below(30);
  cv::Mat1b pattern(2 * radius + 1, period);
  for (auto& value : pattern) value = static_cast<std::uint8_t>(40 + below(150));
  Pair pair{cv::Mat1b(pattern.rows, width), cv::Mat1b(pattern.rows, width)};
  for (int y = 0; y < pattern.rows; ++y) {
    for (int x = 0; x < width; ++x) {
      pair.from(y, x) = cv::saturate_cast<std::uint8_t>(pattern(y, x % period) + below(noise));
      pair.to(y, x) = cv::saturate_cast<std::uint8_t>(pattern(y, (x + shift) % period) +
                                                      below(noise) + brighter);
    }
  }
  return pair;
}

TEST(RowSearch, FindsWhatAPlainSearchFinds) {
  std::mt19937 random(1);
  RowSearch search;
  int found = 0, ambiguous = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const int width = 12 + static_cast<int>(random() % 100);
    const Pair pair = random_pair(random, width);
    search.reserve(width);
    const cv::Point pixel(radius + static_cast<int>(random() % static_cast<unsigned>(width - 6)),
                          radius);
    const int first = static_cast<int>(random() % 40) - 20;
    const int last = first + static_cast<int>(random() % 130);
    const double distinctions[] = {0, 1, 1.2, 2};
    const double distinction = distinctions[random() % 4];
    const auto plain = find_plainly(pair.from, pixel, pair.to, first, last, distinction);
    const auto match = search.find(pair.from, pixel, pair.to, first, last, distinction);
    ASSERT_EQ(match.has_value(), plain.has_value()) << trial;
    found += match ? 1 : 0;
    ambiguous += !match && find_plainly(pair.from, pixel, pair.to, first, last, 0) ? 1 : 0;
    if (!match) continue;
    ASSERT_EQ(match->difference, plain->difference) << trial;
    ASSERT_NEAR(match->x, plain->x, 1e-9) << trial;
  }
  EXPECT_GT(found, 500);
  EXPECT_GT(ambiguous, 200);
}

}  // namespace
}  // namespace dynfilter::detail
