// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_ALLOCATION_COUNTER_HPP
#define DYNFILTER_TESTS_SUPPORT_ALLOCATION_COUNTER_HPP

#include <cstddef>

namespace dynfilter::testing {

/// How often the program has asked for memory, operator new and OpenCV's ways included: in all
/// threads, and in the one that calls. Where that cannot be counted (sanitizers, which bring their
/// own malloc; other C libraries than glibc), `can_count_allocations` is false.
std::size_t allocations_so_far();
std::size_t allocations_of_this_thread_so_far();
extern const bool can_count_allocations;

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_ALLOCATION_COUNTER_HPP
