// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "parallel_for_each.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"

namespace dynfilter::tools {
namespace {

TEST(ParallelForEach, DoesEachWorkOnce) {
  for (const std::size_t count : {0U, 1U, 2U, 3U, 1000U}) {
    std::vector<int> times(count, 0);
    parallel_for_each(count, [&](std::size_t i) { ++times[i]; });
    EXPECT_EQ(std::count(times.begin(), times.end(), 1), static_cast<std::ptrdiff_t>(count));
  }
}

TEST(ParallelForEach, TakesAsManyThreadsAsCoresAndWorks) {
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  for (const std::size_t count : {std::size_t{1}, 8 * cores}) {
    std::mutex mutex;
    std::set<std::thread::id> threads;
    parallel_for_each(count, [&](std::size_t) {
      // Long enough that every thread gets some of the work.
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const std::lock_guard<std::mutex> lock(mutex);
      threads.insert(std::this_thread::get_id());
    });
    EXPECT_LE(threads.size(), std::min(cores, count));
  }
}

TEST(ParallelForEach, PassesTheExceptionOnAndStartsNothingAfterIt) {
  std::mutex mutex;
  std::size_t begun = 0;
  testing::expect_error<std::out_of_range>(
      [&] {
        parallel_for_each(100000, [&](std::size_t i) {
          const std::lock_guard<std::mutex> lock(mutex);
          ++begun;
          if (i == 5) throw std::out_of_range("work 5");
        });
      },
      "work 5");
  EXPECT_LT(begun, 100000U);
}

}  // namespace
}  // namespace dynfilter::tools
