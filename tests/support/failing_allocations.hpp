// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <new>

#include <opencv2/core.hpp>

namespace dynfilter::testing {

// Allocations of this thread, to be counted or to fail: every form of operator new (containers,
// strings, OpenCV's own vectors) and the pixels of every cv::Mat, each matrix as one; neither plain
// malloc (libpng's, cv::fastMalloc outside of matrices) nor other threads. That works under
// sanitizers. Link support/failing_allocations.cpp, which replaces the operators of the whole
// program.

/// Number of this thread's allocations from the first call on.
std::size_t allocations_so_far();

/// Makes the n-th allocation of this thread fail while it lives; n = 1 is the next one. All others
/// succeed, before and after it. A failing operator new throws std::bad_alloc, the nothrow one
/// returns null, a matrix throws cv::Exception.
class FailingAllocation {
 public:
  explicit FailingAllocation(std::size_t n);
  ~FailingAllocation();

  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;

  /// Tells whether the n-th allocation was requested, and so failed.
  static bool has_failed();
};

/// Calls `call` with the n-th allocation failing, and catches the exception of that failure.
/// Returns whether an allocation failed: false means that the call made fewer than n allocations
/// and ran undisturbed.
template <typename Call>
bool fails_at_allocation(const std::size_t n, Call&& call) {
  const FailingAllocation failing(n);
  try {
    call();
  } catch (const std::bad_alloc&) {
    if (!FailingAllocation::has_failed()) throw;
  } catch (const cv::Exception&) {
    if (!FailingAllocation::has_failed()) throw;
  }
  return FailingAllocation::has_failed();
}

/// Calls test(1), test(2), … until it returns false, as fails_at_allocation does once every
/// allocation of its call has failed in turn. Returns the number of failed allocations.
///
///   for_each_failing_allocation([&](const std::size_t n) {
///     Component component;  // allocations here succeed
///     const bool failed = fails_at_allocation(n, [&] { component.run(input); });
///     EXPECT_EQ(component.run(input), expected) << "after allocation " << n << " failed";
///     return failed;
///   });
template <typename Test>
std::size_t for_each_failing_allocation(Test&& test) {
  std::size_t failed = 0;
  while (test(failed + 1)) ++failed;
  return failed;
}

}  // namespace dynfilter::testing
