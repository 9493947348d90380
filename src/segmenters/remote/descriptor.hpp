// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_REMOTE_DESCRIPTOR_HPP
#define DYNFILTER_SRC_SEGMENTERS_REMOTE_DESCRIPTOR_HPP

#include <unistd.h>

#include <utility>

namespace dynfilter::detail {

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }

 private:
  int number_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_REMOTE_DESCRIPTOR_HPP
