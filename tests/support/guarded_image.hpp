// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::testing {

/// Side of an image's memory that has a guard page: a read beyond that end crashes.
enum class Guard { before, behind };

/// Image without padding whose memory begins or ends at a guard page. Begins black.
class GuardedImage {
 public:
  GuardedImage(const cv::Size& size, int type, Guard guard) {
    const auto bytes = static_cast<std::size_t>(size.area() * CV_ELEM_SIZE(type));
    const std::size_t length = (bytes + page() - 1) / page() * page();
    const bool is_small = length <= 64 * page();
    memory_ = is_small ? kept_memory(length) : new_memory(length);
    unsigned char* const begin =
        memory_.get() + page() + (guard == Guard::before ? 0 : length - bytes);
    if (is_small) std::memset(begin, 0, bytes);
    image_ = cv::Mat(size, type, begin);
  }

  /// Matrix in memory that this object and its copies own.
  const cv::Mat& image() const { return image_; }

 private:
  static std::size_t page() {
    static const auto bytes = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    return bytes;
  }

  /// Maps memory of that length between two guard pages.
  static std::shared_ptr<unsigned char> new_memory(std::size_t length) {
    const std::size_t all = length + 2 * page();
    void* const mapped =
        mmap(nullptr, all, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (mapped == MAP_FAILED) throw std::bad_alloc();
    std::shared_ptr<unsigned char> memory(static_cast<unsigned char*>(mapped),
                                          [all](unsigned char* begin) { munmap(begin, all); });
    if (mprotect(memory.get(), page(), PROT_NONE) != 0 ||
        mprotect(memory.get() + page() + length, page(), PROT_NONE) != 0) {
      throw std::bad_alloc();
    }
    return memory;
  }

  /// Returns memory that no image uses any more, because mapping some for each small image would
  /// take most of a fuzzer's time.
  static std::shared_ptr<unsigned char> kept_memory(std::size_t length) {
    static thread_local std::map<std::size_t, std::vector<std::shared_ptr<unsigned char>>> kept;
    auto& of_length = kept[length];
    for (const auto& memory : of_length) {
      if (memory.use_count() == 1) return memory;
    }
    return of_length.emplace_back(new_memory(length));
  }

  std::shared_ptr<unsigned char> memory_;
  cv::Mat image_;
};

}  // namespace dynfilter::testing
