// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Samples of numbers side by side, which are sorted at once.

#ifndef DYNFILTER_DETAIL_SAMPLE_LANES_HPP
#define DYNFILTER_DETAIL_SAMPLE_LANES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/detail/instruction_set.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <immintrin.h>
#endif

namespace dynfilter::detail {

constexpr std::size_t sample_lanes = 8;

/// One number of each sample.
using LaneRow = std::array<std::uint32_t, sample_lanes>;

/// What Batcher's merge exchange sort compares, whatever the values are (D. E. Knuth, The Art of
/// Computer Programming, vol. 3, algorithm 5.2.2 M): runs of rows with those that stand `distance`
/// behind them.
class MergeExchange {
 public:
  explicit MergeExchange(std::size_t count) : count_(count), first_(count) {
    while (2 * longest_ < count) longest_ *= 2;
    run_ = next_ = 2 * longest_;
  }

  /// Goes to the next run. Returns whether there is one.
  bool next() {
    first_ += 2 * run_;
    while (first_ + distance_ >= count_) {
      if (!next_pass()) return false;
    }
    return true;
  }

  std::size_t begin() const { return first_; }
  std::size_t end() const { return std::min(first_ + run_, count_ - distance_); }
  std::size_t distance() const { return distance_; }

 private:
  bool next_pass() {
    if (next_ != run_) {
      distance_ = next_ - run_;
      next_ /= 2;
      first_ = run_;
      return true;
    }
    run_ /= 2;
    distance_ = run_;
    next_ = longest_;
    first_ = 0;
    return run_ > 0;
  }

  std::size_t count_, first_;
  std::size_t longest_ = 1, run_ = 0, next_ = 0, distance_ = 0;
};

inline void put_in_order(LaneRow& first, LaneRow& second) {
  LaneRow lower, upper;
  for (std::size_t k = 0; k < sample_lanes; ++k) lower[k] = std::min(first[k], second[k]);
  for (std::size_t k = 0; k < sample_lanes; ++k) upper[k] = std::max(first[k], second[k]);
  first = lower;
  second = upper;
}

// These sort each lane. O(n log^2 n).

inline void sort_lanes_plainly(LaneRow* rows, std::size_t count) {
  for (MergeExchange runs(count); runs.next();) {
    for (std::size_t i = runs.begin(); i < runs.end(); ++i) {
      put_in_order(rows[i], rows[i + runs.distance()]);
    }
  }
}

#if DYNFILTER_HAS_X86_KERNELS

[[gnu::target("avx2")]] inline void sort_lanes_avx2(LaneRow* rows, std::size_t count) {
  auto* const vectors = reinterpret_cast<__m256i*>(rows);
  for (MergeExchange runs(count); runs.next();) {
    __m256i* const end = vectors + runs.end();
    for (__m256i* first = vectors + runs.begin(); first != end; ++first) {
      __m256i* const second = first + runs.distance();
      const __m256i a = _mm256_loadu_si256(first), b = _mm256_loadu_si256(second);
      _mm256_storeu_si256(first, _mm256_min_epu32(a, b));
      _mm256_storeu_si256(second, _mm256_max_epu32(a, b));
    }
  }
}

#endif

/// By the best instructions up to those of a set.
inline void sort_lanes(LaneRow* rows, std::size_t count, [[maybe_unused]] InstructionSet best) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx2) return sort_lanes_avx2(rows, count);
#endif
  sort_lanes_plainly(rows, count);
}

/// A sample in each lane, in memory that is kept.
class SampleLanes {
 public:
  /// No numbers, with room for so many in each lane.
  SampleLanes(std::vector<LaneRow>& memory, std::size_t most) {
    LaneRow behind_all;
    behind_all.fill(0xFFFFFFFFU);
    memory.assign(most, behind_all);
    rows_ = memory.data();
  }

  std::size_t size(std::size_t lane) const { return sizes_[lane]; }

  /// Adds a number if a condition holds, without a branch. There must be room for it.
  void add_if(bool condition, std::size_t lane, std::uint32_t number) {
    rows_[sizes_[lane]][lane] = condition ? number : 0xFFFFFFFFU;
    sizes_[lane] += condition ? 1 : 0;
  }

  void sort(InstructionSet best) {
    sort_lanes(rows_, *std::max_element(sizes_.begin(), sizes_.end()), best);
  }

  /// What a function makes of each number of a lane, in their order.
  template <class Function>
  void transform(std::size_t lane, std::vector<double>& values, const Function& function) const {
    values.resize(sizes_[lane]);
    for (std::size_t i = 0; i < sizes_[lane]; ++i) values[i] = function(rows_[i][lane]);
  }

 private:
  LaneRow* rows_;
  std::array<std::size_t, sample_lanes> sizes_{};
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_SAMPLE_LANES_HPP
