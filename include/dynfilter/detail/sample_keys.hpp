// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// FeatureSampler::key of many features.

#ifndef DYNFILTER_DETAIL_SAMPLE_KEYS_HPP
#define DYNFILTER_DETAIL_SAMPLE_KEYS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/feature_sampler.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <immintrin.h>
#endif

namespace dynfilter::detail {

/// Keys are made so many at a time, in a loop of a constant number of steps, of which compilers
/// make vector code.
constexpr std::size_t key_step = 16;

// What follows makes the keys of some features of an instance. There must be room for, and pixels
// are read to, a whole number of steps.

[[gnu::always_inline]] inline void make_keys_plainly(std::uint64_t instance_hash, cv::Point corner,
                                                     const cv::Point* pixels, std::size_t count,
                                                     std::uint64_t* keys) {
  for (std::size_t begin = 0; begin < count; begin += key_step) {
    for (std::size_t i = begin; i < begin + key_step; ++i) {
      keys[i] = FeatureSampler::key(instance_hash, wrapping_difference(pixels[i], corner));
    }
  }
}

#if DYNFILTER_HAS_X86_KERNELS

[[gnu::target("avx512f,avx512dq,avx512vl")]] inline void make_keys_avx512(
    std::uint64_t instance_hash, cv::Point corner, const cv::Point* pixels, std::size_t count,
    std::uint64_t* keys) {
  make_keys_plainly(instance_hash, corner, pixels, count, keys);
}

[[gnu::target("avx2")]] inline void make_keys_avx2(std::uint64_t instance_hash, cv::Point corner,
                                                   const cv::Point* pixels, std::size_t count,
                                                   std::uint64_t* keys) {
  make_keys_plainly(instance_hash, corner, pixels, count, keys);
}

#endif

/// By the best instructions up to those of a set.
inline void make_keys(std::uint64_t instance_hash, cv::Point corner, const cv::Point* pixels,
                      std::size_t count, [[maybe_unused]] InstructionSet best,
                      std::uint64_t* keys) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx512) {
    return make_keys_avx512(instance_hash, corner, pixels, count, keys);
  }
  if (best >= InstructionSet::avx2) {
    return make_keys_avx2(instance_hash, corner, pixels, count, keys);
  }
#endif
  make_keys_plainly(instance_hash, corner, pixels, count, keys);
}

// What follows puts the indices from `begin` to `end` whose keys are up to a highest one where
// `low` points, and returns how many they are. What lies behind them, up to eight, may be
// overwritten, and keys are read to a whole number of eights.

inline std::size_t list_low_keys_plainly(const std::uint64_t* keys, std::uint32_t begin,
                                         std::uint32_t end, std::uint64_t highest,
                                         std::uint32_t* low) {
  std::size_t count = 0;
  for (std::uint32_t i = begin; i != end; ++i) {
    low[count] = i;
    count += keys[i] <= highest ? 1 : 0;  // no branch, which nobody could foresee
  }
  return count;
}

#if DYNFILTER_HAS_X86_KERNELS

[[gnu::target("avx512f,avx512vl,popcnt")]] inline std::size_t list_low_keys_avx512(
    const std::uint64_t* keys, std::uint32_t begin, std::uint32_t end, std::uint64_t highest,
    std::uint32_t* low) {
  constexpr std::uint32_t lanes = 8;
  const __m512i limit = _mm512_set1_epi64(static_cast<long long>(highest));
  const __m256i numbers = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  std::size_t count = 0;
  for (std::uint32_t i = begin; i < end; i += lanes) {
    const std::uint32_t there = end - i < lanes ? (1U << (end - i)) - 1 : 0xFFU;
    const auto mask =
        static_cast<__mmask8>(_mm512_cmple_epu64_mask(_mm512_loadu_si512(keys + i), limit) & there);
    const __m256i indices = _mm256_add_epi32(_mm256_set1_epi32(static_cast<int>(i)), numbers);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(low + count),
                        _mm256_maskz_compress_epi32(mask, indices));
    count += static_cast<std::size_t>(_mm_popcnt_u32(mask));
  }
  return count;
}

#endif

/// By the best instructions up to those of a set.
inline std::size_t list_low_keys(const std::uint64_t* keys, std::uint32_t begin, std::uint32_t end,
                                 std::uint64_t highest, [[maybe_unused]] InstructionSet best,
                                 std::uint32_t* low) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx512) return list_low_keys_avx512(keys, begin, end, highest, low);
#endif
  return list_low_keys_plainly(keys, begin, end, highest, low);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_SAMPLE_KEYS_HPP
