// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_ALLOCATION_LIMIT_HPP
#define DYNFILTER_TESTS_SUPPORT_ALLOCATION_LIMIT_HPP

namespace dynfilter::testing {

/// Lets operator new succeed so many times while it lives, fail once, and succeed from then on.
class AllocationLimit {
 public:
  explicit AllocationLimit(long allocations);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_ALLOCATION_LIMIT_HPP
