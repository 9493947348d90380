// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// How keep_static moves what is kept to the front of all columns at once.

#ifndef DYNFILTER_DETAIL_COMPACTION_HPP
#define DYNFILTER_DETAIL_COMPACTION_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/labels.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <immintrin.h>
#endif

namespace dynfilter::detail {

// What follows puts elements of a column, one after the other, where the first removed one was.
// None of them is there already.

/// Of a vector.
template <class T>
class KeptElements {
 public:
  template <class Allocator>
  KeptElements(std::vector<T, Allocator>& column, std::size_t first_removed)
      : first_(column.data()), next_(column.data() + first_removed) {}

  void append(std::size_t i) {
    if constexpr (std::is_trivially_copyable<T>::value) {
      // A few loads and stores, where an assignment goes member by member.
      std::memcpy(static_cast<void*>(next_), first_ + i, sizeof(T));
    } else {
      *next_ = std::move(first_[i]);
    }
    ++next_;
  }

 private:
  T* first_;
  T* next_;
};

/// Of bits, which have no addresses.
template <class Allocator>
class KeptBits {
 public:
  KeptBits(std::vector<bool, Allocator>& column, std::size_t first_removed)
      : first_(column.begin()),
        next_(std::next(first_, static_cast<std::ptrdiff_t>(first_removed))) {}

  void append(std::size_t i) { *next_++ = first_[static_cast<std::ptrdiff_t>(i)]; }

 private:
  typename std::vector<bool, Allocator>::iterator first_, next_;
};

/// Of the rows of a matrix.
class KeptRows {
 public:
  KeptRows(const cv::Mat& column, std::size_t first_removed)
      : first_(column.data),
        next_(column.data + first_removed * column.step[0]),
        step_(column.step[0]),
        row_bytes_(static_cast<std::size_t>(column.cols) * column.elemSize()) {}

  void append(std::size_t i) {
    if (is_orb()) {
      std::memcpy(next_, row(i), orb_bytes);
    } else if (row_bytes_ > 0) {
      std::memcpy(next_, row(i), row_bytes_);
    }
    next_ += step_;
  }

#if DYNFILTER_HAS_X86_KERNELS
  /// Compilers store 32 bytes in two steps unless they are told; stores are what this waits for.
  [[gnu::target("avx2"), gnu::always_inline]] void append_avx2(std::size_t i) {
    if (!is_orb()) return append(i);
    const __m256i descriptor = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row(i)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(next_), descriptor);
    next_ += step_;
  }
#endif

 private:
  static constexpr std::size_t orb_bytes = 32;  // known lengths are copied at once

  bool is_orb() const { return row_bytes_ == orb_bytes; }
  const std::uint8_t* row(std::size_t i) const { return first_ + i * step_; }

  const std::uint8_t* first_;
  std::uint8_t* next_;
  std::size_t step_, row_bytes_;
};

template <class T, class Allocator>
KeptElements<T> kept_of(std::vector<T, Allocator>& column, std::size_t first_removed) {
  return {column, first_removed};
}

template <class Allocator>
KeptBits<Allocator> kept_of(std::vector<bool, Allocator>& column, std::size_t first_removed) {
  return {column, first_removed};
}

inline KeptRows kept_of(const cv::Mat& column, std::size_t first_removed) {
  return {column, first_removed};
}

/// The number of features where none is removed.
inline std::size_t first_removed(const FeatureLabels& labels) {
  const std::vector<std::uint64_t>& removed = labels.removed_bits();
  for (std::size_t block = 0; block < removed.size(); ++block) {
    if (removed[block] != 0) return block * block_size + lowest_bit(removed[block]);
  }
  return labels.size();
}

/// The features of a block that are kept and not below `begin`, as bits.
inline std::uint64_t kept_bits(const FeatureLabels& labels, std::size_t block, std::size_t begin) {
  const std::size_t first = block * block_size;
  const std::uint64_t kept = ~labels.removed_bits()[block] & bits_below(labels.size() - first);
  return begin > first ? kept & ~bits_below(begin - first) : kept;
}

// These append the kept features from `begin` on to all columns, and return how many they are.

template <class... Kept>
std::size_t append_kept_plainly(const FeatureLabels& labels, std::size_t begin, Kept... kept) {
  std::size_t count = 0;
  for (std::size_t block = begin / block_size; block < blocks_for(labels.size()); ++block) {
    const std::size_t first = block * block_size;
    const std::uint64_t bits = kept_bits(labels, block, begin);
    for_each_bit(bits, [&](std::size_t bit) { (kept.append(first + bit), ...); });
    count += count_bits(bits);
  }
  return count;
}

#if DYNFILTER_HAS_X86_KERNELS

#define DYNFILTER_AVX2 gnu::target("avx2,bmi")

template <class Kept>
[[DYNFILTER_AVX2, gnu::always_inline]] inline void append_avx2(Kept& kept, std::size_t i) {
  kept.append(i);
}

[[DYNFILTER_AVX2, gnu::always_inline]] inline void append_avx2(KeptRows& kept, std::size_t i) {
  kept.append_avx2(i);
}

template <class... Kept>
[[DYNFILTER_AVX2]] std::size_t append_kept_avx2(const FeatureLabels& labels, std::size_t begin,
                                                Kept... kept) {
  std::size_t count = 0;
  for (std::size_t block = begin / block_size; block < blocks_for(labels.size()); ++block) {
    const std::size_t first = block * block_size;
    std::uint64_t bits = kept_bits(labels, block, begin);
    count += count_bits(bits);
    for (; bits != 0; bits = _blsr_u64(bits)) {
      const std::size_t i = first + _tzcnt_u64(bits);
      (append_avx2(kept, i), ...);
    }
  }
  return count;
}

#undef DYNFILTER_AVX2

#endif

/// Moves the kept features of all columns to the front, by the best instructions up to those of a
/// set. Returns how many they are.
template <class... Columns>
std::size_t move_kept(const FeatureLabels& labels, [[maybe_unused]] InstructionSet best,
                      Columns&... columns) {
  const std::size_t begin = first_removed(labels);
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx2) {
    return begin + append_kept_avx2(labels, begin, kept_of(columns, begin)...);
  }
#endif
  return begin + append_kept_plainly(labels, begin, kept_of(columns, begin)...);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_COMPACTION_HPP
