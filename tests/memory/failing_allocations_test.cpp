// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "support/failing_allocations.hpp"

#include <memory>
#include <new>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace dynfilter::testing {
namespace {

struct alignas(64) Aligned {
  char bytes[64];
};

TEST(FailingAllocations, EachAllocationOfACallFailsOnce) {
  std::vector<int> steps;
  const std::size_t failed = for_each_failing_allocation([&](const std::size_t n) {
    int step = 0;
    std::vector<int> numbers;  // outside the call, else compilers may remove them
    std::unique_ptr<Aligned> aligned;
    const bool one_failed = fails_at_allocation(n, [&] {
      numbers.resize(10);
      step = 1;
      aligned = std::make_unique<Aligned>();
      step = 2;
      const cv::Mat matrix(4, 4, CV_8UC1);
      step = 3;
    });
    steps.push_back(step);
    return one_failed;
  });
  EXPECT_EQ(failed, 3u);
  EXPECT_EQ(steps, (std::vector<int>{0, 1, 2, 3}));
}

TEST(FailingAllocations, NothrowNewReturnsNull) {
  int* memory = nullptr;
  EXPECT_TRUE(fails_at_allocation(1, [&] { memory = new (std::nothrow) int(7); }));
  EXPECT_EQ(memory, nullptr);
}

TEST(FailingAllocations, NothingFailsOutsideTheCall) {
  EXPECT_FALSE(
      fails_at_allocation(9, [] { static_cast<void>(cv::Mat(4, 4, CV_8UC1).isContinuous()); }));
  EXPECT_NO_THROW(std::vector<int>(10));
  EXPECT_NO_THROW(cv::Mat(4, 4, CV_8UC1));
}

TEST(FailingAllocations, UnrelatedExceptionsPassThrough) {
  EXPECT_THROW(fails_at_allocation(9, [] { throw std::bad_alloc(); }), std::bad_alloc);
}

}  // namespace
}  // namespace dynfilter::testing
