// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_BENCH_ALLOCATION_COUNTER_HPP
#define DYNFILTER_BENCH_ALLOCATION_COUNTER_HPP

#include <cstddef>

namespace dynfilter::benchmarks {

/// How often this thread has asked for memory, operator new and OpenCV's ways included. Where that
/// cannot be counted (another C library than glibc), `can_count_allocations` is false.
std::size_t allocations_so_far();
extern const bool can_count_allocations;

}  // namespace dynfilter::benchmarks

#endif  // DYNFILTER_BENCH_ALLOCATION_COUNTER_HPP
