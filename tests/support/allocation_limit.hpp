// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_ALLOCATION_LIMIT_HPP
#define DYNFILTER_TESTS_SUPPORT_ALLOCATION_LIMIT_HPP

namespace dynfilter::testing {

/// Makes operator new fail once while it lives, after the given number of successes.
class AllocationLimit {
 public:
  explicit AllocationLimit(long allocations);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_ALLOCATION_LIMIT_HPP
