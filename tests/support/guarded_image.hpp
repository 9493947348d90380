// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_GUARDED_IMAGE_HPP
#define DYNFILTER_TESTS_SUPPORT_GUARDED_IMAGE_HPP

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <memory>
#include <new>

#include <opencv2/core.hpp>

namespace dynfilter::testing {

/// Side of an image's memory that has a guard page: a read beyond that end crashes.
enum class Guard { before, behind };

/// Image without padding whose memory begins or ends at a guard page.
class GuardedImage {
 public:
  GuardedImage(const cv::Size& size, int type, Guard guard) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const std::size_t bytes = size.area() * CV_ELEM_SIZE(type);
    const std::size_t pages = (bytes + page - 1) / page * page;
    const std::size_t mapped = pages + page;
    void* const memory =
        mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    memory_.reset(memory, [mapped](void* mapping) { munmap(mapping, mapped); });
    auto* const first = static_cast<unsigned char*>(memory);
    unsigned char* const guard_page = guard == Guard::before ? first : first + pages;
    if (mprotect(guard_page, page, PROT_NONE) != 0) throw std::bad_alloc();
    image_ = cv::Mat(size, type, guard == Guard::before ? first + page : guard_page - bytes);
  }

  /// Matrix in memory that this object and its copies own.
  const cv::Mat& image() const { return image_; }

 private:
  std::shared_ptr<void> memory_;
  cv::Mat image_;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_GUARDED_IMAGE_HPP
