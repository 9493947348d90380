// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The filter allocates nothing once a frame of that size was seen: every way to the heap is
// counted, the operator new of the standard library and the functions that OpenCV calls.

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>

#include "support/filter_case.hpp"

// Sanitizers bring their own malloc, and other C libraries do not export these names.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DYNFILTER_COUNTS_ALLOCATIONS 1
#endif
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#undef DYNFILTER_COUNTS_ALLOCATIONS
#endif
#endif

#ifdef DYNFILTER_COUNTS_ALLOCATIONS

namespace {
std::atomic<std::size_t> allocations{0};
}

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++allocations;
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  ++allocations;
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
namespace {

#ifdef DYNFILTER_COUNTS_ALLOCATIONS

template <class Action>
std::size_t allocations_of(const Action& action) {
  const std::size_t before = allocations;
  action();
  return allocations - before;
}

FilterCase full_size_case(std::uint64_t seed) {
  ByteSource source(seed);
  FilterCase input;
  const cv::Size image(640, 480);
  input.frame.id = seed;
  input.frame.depth = cv::Mat(image, CV_16UC1, cv::Scalar(7000));
  input.frame.metres_per_unit = 1.0 / 5000;
  input.segmentation.image_size = image;
  for (int k = 0; k < 3; ++k) {
    const cv::Rect box(40 + 190 * k, 60, 180, 400);
    Instance person = Instance::from_box(box);
    person.mask_origin = box.tl();
    person.mask = cv::Mat(200, 180, CV_8UC1, cv::Scalar(255));
    input.segmentation.instances.push_back(person);
  }
  for (int i = 0; i < 1000; ++i) {
    input.keypoints.emplace_back(static_cast<float>(source.between(16, 623)),
                                 static_cast<float>(source.between(16, 463)), 31.0F);
  }
  return input;
}

TEST(Allocations, AreCounted) {
  // Written to something volatile, or the compiler may leave the allocation out.
  const void* volatile seen = nullptr;
  EXPECT_GE(allocations_of([&] {
              const std::vector<int> numbers(100);
              seen = numbers.data();
            }),
            1U);
  EXPECT_GE(allocations_of([&] {
              const cv::Mat matrix(100, 100, CV_8UC1);
              seen = matrix.data;
            }),
            1U);
}

TEST(Allocations, TheFilterNeedsNoneInTheSteadyState) {
  DynamicFilterOptions options;
  options.mask_culler.margin_px = 2;
  const DynamicFilter filter(options);
  FeatureLabels labels;
  Workspace workspace;
  FilterCase first = full_size_case(1);
  // No feature of the first frame is on a mask: its size alone must be enough to know.
  for (Instance& person : first.segmentation.instances) person.mask_origin.y = 1000;
  filter.apply(first.frame, first.segmentation, first.keypoints, labels, workspace);
  for (std::uint64_t seed = 2; seed < 20; ++seed) {
    FilterCase input = full_size_case(seed);
    input.keypoints.resize(1000 - 10 * seed);
    const std::size_t count = allocations_of(
        [&] { filter.apply(input.frame, input.segmentation, input.keypoints, labels, workspace); });
    ASSERT_EQ(count, 0U) << "frame " << seed;
    ASSERT_GT(labels.statistics().compensated, 0U) << "or nothing was shown";
  }
}

TEST(Allocations, KeepStaticNeedsNoneForColumnsOfItsOwn) {
  FilterCase input = full_size_case(1);
  const FeatureLabels labels =
      DynamicFilter().apply(input.frame, input.segmentation, input.keypoints);
  cv::Mat descriptors = cv::Mat::zeros(1000, 32, CV_8UC1);
  EXPECT_EQ(allocations_of([&] { keep_static(labels, input.keypoints, descriptors); }), 0U);
  EXPECT_LT(descriptors.rows, 1000);
}

#else

TEST(Allocations, TheFilterNeedsNoneInTheSteadyState) {
  GTEST_SKIP() << "allocations are counted with glibc and without sanitizers only";
}

#endif

}  // namespace
}  // namespace dynfilter::testing
