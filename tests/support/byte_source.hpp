// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_BYTE_SOURCE_HPP
#define DYNFILTER_TESTS_SUPPORT_BYTE_SOURCE_HPP

#include <cstddef>
#include <cstdint>
#include <random>

namespace dynfilter::testing {

/// Source of a test case's choices: the bytes of a fuzzer, or a seeded generator. One body thus
/// serves fuzzing, its replay, and random tests.
class ByteSource {
 public:
  ByteSource(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  explicit ByteSource(std::uint64_t seed) : random_(seed), is_random_(true) {}

  std::uint8_t byte() {
    if (is_random_) return static_cast<std::uint8_t>(random_() >> 24U);
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }

  std::uint32_t word() {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8U | byte();
    return value;
  }

  /// Number from `first` to `last`, both included.
  int between(int first, int last) {
    const auto span = static_cast<std::uint32_t>(last - first) + 1U;
    return first + static_cast<int>((span <= 256 ? byte() : word()) % span);
  }

  bool chance(int percent) { return between(0, 99) < percent; }

 private:
  const std::uint8_t* data_ = nullptr;
  std::size_t left_ = 0;
  std::mt19937_64 random_;
  bool is_random_ = false;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_BYTE_SOURCE_HPP
