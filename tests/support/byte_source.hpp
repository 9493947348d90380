// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <random>

namespace dynfilter::testing {

/// Source of a test case's choices: the bytes of a fuzzer, or a seeded generator. One body thus
/// serves fuzzing, its replay, and random tests.
class ByteSource {
 public:
  ByteSource(const std::uint8_t* data, std::size_t size)
      : data_(data), left_(size), begin_(data), size_(size) {}
  explicit ByteSource(std::uint64_t seed) : is_fuzzed_(false), random_(seed) {}

  std::uint8_t byte() {
    if (!is_fuzzed_) return static_cast<std::uint8_t>(random_() >> 24U);
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

  /// Whether this input may be one of the costly ones: one in `count` of a fuzzer's inputs, by all
  /// of their bytes, so that it cannot breed costly ones; always with a generator. Takes no byte.
  bool may_be_costly(unsigned count) const {
    std::uint32_t digest = 2166136261U;  // FNV-1a
    for (std::size_t i = 0; i < size_; ++i) digest = (digest ^ begin_[i]) * 16777619U;
    return !is_fuzzed_ || (digest >> 8U) % count == 0;
  }

  bool is_fuzzed() const { return is_fuzzed_; }

  bool chance(int percent) { return between(0, 99) < percent; }

 private:
  const std::uint8_t* data_ = nullptr;
  std::size_t left_ = 0;
  const std::uint8_t* begin_ = nullptr;
  std::size_t size_ = 0;
  bool is_fuzzed_ = true;
  std::mt19937_64 random_;  // of a seeded generator
};

}  // namespace dynfilter::testing
