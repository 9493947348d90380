// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "support/failing_allocations.hpp"

#include <cstdlib>

namespace dynfilter::testing {
namespace {

thread_local std::size_t allocations = 0;
thread_local std::size_t allocations_left = 0;  // up to the failing one; 0: none fails
thread_local bool failed = false;

bool is_turn_to_fail() {
  ++allocations;
  if (allocations_left == 0 || --allocations_left != 0) return false;
  failed = true;
  return true;
}

/// OpenCV's matrix allocator, except for the allocation that fails.
class FailingMatAllocator final : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, std::size_t* step,
                         cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    if (is_turn_to_fail()) CV_Error(cv::Error::StsNoMem, "the allocation that a test lets fail");
    // OpenCV would leak the pixels if the allocation of their header failed inside: let it succeed.
    const std::size_t left = allocations_left, so_far = allocations;
    allocations_left = 0;
    cv::UMatData* const matrix =
        cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
    allocations_left = left;
    allocations = so_far;
    return matrix;
  }
  bool allocate(cv::UMatData* data, cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    return cv::Mat::getStdAllocator()->allocate(data, flags, usage);
  }
  void deallocate(cv::UMatData* data) const override {
    cv::Mat::getStdAllocator()->deallocate(data);
  }
};

/// Installs the allocator for the rest of the program, because its matrices may live as long.
void count_matrices() {
  static FailingMatAllocator* const allocator = [] {
    auto* const made = new FailingMatAllocator;
    cv::Mat::setDefaultAllocator(made);
    return made;
  }();
  static_cast<void>(allocator);
}

void* allocate(const std::size_t size) {
  return is_turn_to_fail() ? nullptr : std::malloc(size == 0 ? 1 : size);
}

void* allocate(const std::size_t size, const std::align_val_t alignment) {
  if (is_turn_to_fail()) return nullptr;
  const auto step = static_cast<std::size_t>(alignment);
  return std::aligned_alloc(step, (size + step) / step * step);
}

void* not_null(void* const memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

std::size_t allocations_so_far() {
  count_matrices();
  return allocations;
}

FailingAllocation::FailingAllocation(const std::size_t n) {
  count_matrices();
  failed = false;
  allocations_left = n;
}

FailingAllocation::~FailingAllocation() { allocations_left = 0; }

bool FailingAllocation::has_failed() { return failed; }

}  // namespace dynfilter::testing

using dynfilter::testing::allocate;
using dynfilter::testing::not_null;

void* operator new(std::size_t size) { return not_null(allocate(size)); }
void* operator new[](std::size_t size) { return not_null(allocate(size)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return not_null(allocate(size, alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return not_null(allocate(size, alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return allocate(size, alignment);
}
void* operator new[](std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return allocate(size, alignment);
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t, const std::nothrow_t&) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::align_val_t, const std::nothrow_t&) noexcept {
  std::free(memory);
}
