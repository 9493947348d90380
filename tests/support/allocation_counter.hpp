// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_ALLOCATION_COUNTER_HPP
#define DYNFILTER_TESTS_SUPPORT_ALLOCATION_COUNTER_HPP

#include <cstddef>

namespace dynfilter::testing {

/// Counts the program's requests for memory so far, operator new and OpenCV's functions included:
/// in all threads, and in the calling one. `can_count_allocations` is false where they cannot be
/// counted: under sanitizers, which bring their own malloc, and with C libraries other than glibc.
std::size_t allocations_so_far();
std::size_t allocations_of_this_thread_so_far();
extern const bool can_count_allocations;

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_ALLOCATION_COUNTER_HPP
