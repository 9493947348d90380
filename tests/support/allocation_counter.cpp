// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "support/allocation_counter.hpp"

#include <atomic>
#include <cstdlib>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DYNFILTER_COUNTS_ALLOCATIONS 1
#endif
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#undef DYNFILTER_COUNTS_ALLOCATIONS
#endif
#endif

namespace {
std::atomic<std::size_t> allocations{0};
thread_local std::size_t allocations_of_this_thread = 0;
}  // namespace

#ifdef DYNFILTER_COUNTS_ALLOCATIONS

namespace {
void count() {
  ++allocations;
  ++allocations_of_this_thread;
}
}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t elements, std::size_t size) {
  count();
  return __libc_calloc(elements, size);
}
void* realloc(void* memory, std::size_t size) {
  count();
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  *memory = memalign(alignment, size);
  return *memory == nullptr ? 12 : 0;  // ENOMEM
}
}

#endif  // DYNFILTER_COUNTS_ALLOCATIONS

namespace dynfilter::testing {

#ifdef DYNFILTER_COUNTS_ALLOCATIONS
const bool can_count_allocations = true;
#else
const bool can_count_allocations = false;
#endif

std::size_t allocations_so_far() { return allocations; }
std::size_t allocations_of_this_thread_so_far() { return allocations_of_this_thread; }

}  // namespace dynfilter::testing
