// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// FeatureSampler::key of many features.

#ifndef DYNFILTER_DETAIL_SAMPLE_KEYS_HPP
#define DYNFILTER_DETAIL_SAMPLE_KEYS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/instruction_set.hpp"
#include "dynfilter/feature_sampler.hpp"

namespace dynfilter::detail {

// These replace the hashes of the instances of a block of features by the features' keys, in a loop
// of a constant number of steps, of which compilers make vector code. The pixels are relative to
// the instances' boxes.

[[gnu::always_inline]] inline void make_keys_plainly(const cv::Point* pixels, std::uint64_t* keys) {
  for (std::size_t i = 0; i < block_size; ++i) keys[i] = FeatureSampler::key(keys[i], pixels[i]);
}

#if DYNFILTER_HAS_X86_KERNELS

[[gnu::target("avx512f,avx512dq,avx512vl")]] inline void make_keys_avx512(const cv::Point* pixels,
                                                                          std::uint64_t* keys) {
  make_keys_plainly(pixels, keys);
}

[[gnu::target("avx2")]] inline void make_keys_avx2(const cv::Point* pixels, std::uint64_t* keys) {
  make_keys_plainly(pixels, keys);
}

#endif

/// By the best instructions up to those of a set.
inline void make_keys(const cv::Point* pixels, [[maybe_unused]] InstructionSet best,
                      std::uint64_t* keys) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx512) return make_keys_avx512(pixels, keys);
  if (best >= InstructionSet::avx2) return make_keys_avx2(pixels, keys);
#endif
  make_keys_plainly(pixels, keys);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_SAMPLE_KEYS_HPP
