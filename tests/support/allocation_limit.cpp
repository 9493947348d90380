// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A separate file, because compilers that see operator new and delete inlined warn about them.

#include "support/allocation_limit.hpp"

#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

thread_local long allocations_left = -1;  // before one fails; negative: all succeed

}  // namespace

void* operator new(std::size_t size) {
  if (allocations_left-- == 0) throw std::bad_alloc();
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace dynfilter::testing {

AllocationLimit::AllocationLimit(long allocations) { allocations_left = allocations; }
AllocationLimit::~AllocationLimit() { allocations_left = -1; }

}  // namespace dynfilter::testing
