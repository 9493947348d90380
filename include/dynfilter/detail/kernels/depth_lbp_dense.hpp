// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Dense D-LBP: by AVX2 where the processor that runs the program has it, whatever the program was
// compiled for, else by the vector extensions of GCC and Clang.
//
// The idea: each depth is reversed once, to a signed integer that is smaller the farther it is, and
// greater than every depth if there is none. Then "the neighbour is known and farther" is one
// comparison, centre > neighbour, for floats too. Three reversed rows lie in a buffer that stays in
// the L1 cache. It is longer than a row, so a kernel works in whole vectors and reads nothing
// beyond the image. AVX2 packs the comparisons of 32 pixels to bytes, 0 or 0xFF. The rounded
// average of a code and such a byte, (code + byte + 1) / 2, shifts the code to the right and puts
// the comparison into its top bit, in one instruction. It is exact, because a code's lowest bit is
// 0 until the eighth comparison. At last the codes of pixels without depth and on the border become
// 0.

#pragma once

#include "dynfilter/detail/kernels/instruction_set.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>
#ifdef DYNFILTER_AVX2
#include <immintrin.h>
#endif

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_lbp_point.hpp"

namespace dynfilter::detail {

/// Reversed depths, and vectors of so many. `none` is the reversed 0.
template <class Depth, int columns = 1>
struct ReversedDepth {
  using Bits = typename DepthBits<Depth>::Type;
  using Type = std::make_signed_t<Bits>;
  static constexpr auto none =
      static_cast<Type>(std::numeric_limits<Type>::min() + (DepthBits<Depth>::beyond - 1LL));

  typedef Bits BitVector __attribute__((vector_size(columns * sizeof(Depth))));
  typedef Type Vector __attribute__((vector_size(columns * sizeof(Depth))));
  typedef std::uint16_t Halves __attribute__((vector_size(columns * 2)));
  typedef std::uint8_t Codes __attribute__((vector_size(columns)));
};

/// Reverses depths, so many at a time.
template <int columns, class Depth, class Reversed>
[[gnu::always_inline]] inline void reverse_depths(const Depth* from, int count, Reversed* to) {
  using Types = ReversedDepth<Depth, columns>;
  constexpr auto none = static_cast<typename Types::Bits>(Types::none);
  int x = 0;
  for (; x + columns <= count; x += columns) {
    typename Types::BitVector depths;
    std::memcpy(&depths, from + x, sizeof(depths));
    depths = none - depths;
    std::memcpy(to + x, &depths, sizeof(depths));
  }
  for (; x < count; ++x) to[x] = static_cast<Reversed>(none - DepthBits<Depth>::at(from + x));
}

/// Kernel for any processor, with vectors of 16 bytes.
template <class Depth>
struct DepthLbpPortable {
  static constexpr int columns = 16 / sizeof(Depth);
  using Types = ReversedDepth<Depth, columns>;
  using Reversed = typename Types::Type;
  using Vector = typename Types::Vector;

  static void reverse(const Depth* from, int count, Reversed* to) {
    reverse_depths<columns>(from, count, to);
  }

  /// Computes the codes of `width` pixels, a multiple of 32, from three reversed rows.
  static void code_row(const Reversed* upper, const Reversed* middle, const Reversed* lower,
                       int width, std::uint8_t* codes) {
    for (int x = 0; x < width; x += columns) {
      Vector centre, code = {};
      std::memcpy(&centre, middle + x, sizeof(centre));
      add_bit(1, centre, upper + x - 1, code);
      add_bit(2, centre, upper + x, code);
      add_bit(4, centre, upper + x + 1, code);
      add_bit(8, centre, middle + x + 1, code);
      add_bit(16, centre, lower + x + 1, code);
      add_bit(32, centre, lower + x, code);
      add_bit(64, centre, lower + x - 1, code);
      add_bit(128, centre, middle + x - 1, code);
      code &= centre < Types::none;
      // In two steps, because GCC 12 takes the codes of floats apart in one.
      const auto halves = __builtin_convertvector(code, typename Types::Halves);
      const auto bytes = __builtin_convertvector(halves, typename Types::Codes);
      std::memcpy(codes + x, &bytes, sizeof(bytes));
    }
  }

  [[gnu::always_inline]] static inline void add_bit(Reversed weight, const Vector& centre,
                                                    const Reversed* neighbours, Vector& code) {
    Vector neighbour;
    std::memcpy(&neighbour, neighbours, sizeof(neighbour));
    code |= (centre > neighbour) & weight;
  }
};

#ifdef DYNFILTER_AVX2
/// Kernel for AVX2. A vector has 32 bytes.
template <class Depth>
struct DepthLbpAvx2 {
  using Reversed = typename ReversedDepth<Depth>::Type;

  [[DYNFILTER_AVX2]] static void reverse(const Depth* from, int count, Reversed* to) {
    reverse_depths<32 / sizeof(Depth)>(from, count, to);
  }

  /// Does what the portable one does. Where it is not aligned, it may take 6 % longer.
  [[DYNFILTER_AVX2, gnu::aligned(64)]] static void code_row(const Reversed* upper,
                                                            const Reversed* middle,
                                                            const Reversed* lower, int width,
                                                            std::uint8_t* codes) {
    Reversed none[32];  // none > centre is one instruction, centre >= none would be two.
    std::fill_n(none, 32, ReversedDepth<Depth>::none);
    const __m256i order = sizeof(Depth) == 4 ? _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7)
                                             : _mm256_setr_epi32(0, 1, 4, 5, 2, 3, 6, 7);
    for (int x = 0; x < width; x += 32) {
      const Reversed* const centre = middle + x;
      __m256i code = _mm256_avg_epu8(_mm256_setzero_si256(), greater(centre, upper + x - 1));
      code = _mm256_avg_epu8(code, greater(centre, upper + x));
      code = _mm256_avg_epu8(code, greater(centre, upper + x + 1));
      code = _mm256_avg_epu8(code, greater(centre, centre + 1));
      code = _mm256_avg_epu8(code, greater(centre, lower + x + 1));
      code = _mm256_avg_epu8(code, greater(centre, lower + x));
      code = _mm256_avg_epu8(code, greater(centre, lower + x - 1));
      code = _mm256_avg_epu8(code, greater(centre, centre - 1));
      code = _mm256_and_si256(greater(none, centre), code);
      code = _mm256_permutevar8x32_epi32(code, order);
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(codes + x), code);
    }
  }

  /// Compares 32 reversed depths: 0xFF where the first is greater. Packs work in halves of a
  /// vector, so the bytes are not in order.
  [[DYNFILTER_AVX2, gnu::always_inline]] static inline __m256i greater(const std::int16_t* a,
                                                                       const std::int16_t* b) {
    return _mm256_packs_epi16(_mm256_cmpgt_epi16(load(a), load(b)),
                              _mm256_cmpgt_epi16(load(a + 16), load(b + 16)));
  }
  [[DYNFILTER_AVX2, gnu::always_inline]] static inline __m256i greater(const std::int32_t* a,
                                                                       const std::int32_t* b) {
    return _mm256_packs_epi16(_mm256_packs_epi32(_mm256_cmpgt_epi32(load(a), load(b)),
                                                 _mm256_cmpgt_epi32(load(a + 8), load(b + 8))),
                              _mm256_packs_epi32(_mm256_cmpgt_epi32(load(a + 16), load(b + 16)),
                                                 _mm256_cmpgt_epi32(load(a + 24), load(b + 24))));
  }

  [[DYNFILTER_AVX2, gnu::always_inline]] static inline __m256i load(const void* from) {
    return _mm256_loadu_si256(static_cast<const __m256i*>(from));
  }
};
#endif

/// Computes the codes of a region whose rows all have a row above and below.
template <class Depth, class Kernel>
void depth_lbp_rows(const cv::Mat& depth, const cv::Rect& region, cv::Mat& codes) {
  using Reversed = typename ReversedDepth<Depth>::Type;
  constexpr int max_columns = 1280;  // With more, three rows would leave the L1 cache.
  constexpr int before = 64 / sizeof(Depth);
  alignas(64) Reversed buffer[3][before + max_columns + 32] = {};
  Reversed *upper = buffer[0] + before, *middle = buffer[1] + before, *lower = buffer[2] + before;
  const int end_x = region.x + region.width, end_y = region.y + region.height;
  for (int first = region.x; first < end_x; first += max_columns) {
    const int columns = std::min(max_columns, end_x - first), whole = columns / 32 * 32;
    const bool has_left = first > 0, has_right = first + columns < depth.cols;
    const auto reverse_row = [&](int y, Reversed* to) {
      Kernel::reverse(depth.ptr<Depth>(y) + first - has_left, has_left + columns + has_right,
                      to - has_left);
    };
    reverse_row(region.y - 1, upper);
    reverse_row(region.y, middle);
    for (int y = region.y; y < end_y; ++y) {
      reverse_row(y + 1, lower);
      std::uint8_t* const to = codes.ptr<std::uint8_t>(y) + first;
      Kernel::code_row(upper, middle, lower, whole, to);
      if (whole < columns) {
        std::uint8_t rest[32];
        Kernel::code_row(upper + whole, middle + whole, lower + whole, 32, rest);
        std::memcpy(to + whole, rest, static_cast<std::size_t>(columns - whole));
      }
      if (!has_left) to[0] = 0;
      if (!has_right) to[columns - 1] = 0;
      std::swap(upper, middle);
      std::swap(middle, lower);
    }
  }
}

/// Computes the codes of a region, which must lie in the image: 0 on the border. With `avx2`, the
/// processor must have it.
template <class Depth>
void dense_depth_lbp(const cv::Mat& depth, const cv::Rect& region, cv::Mat& codes,
                     [[maybe_unused]] bool avx2 = has_avx2()) {
  for (const int y : {0, depth.rows - 1}) {
    if (y < region.y || y >= region.y + region.height) continue;
    std::memset(codes.ptr(y) + region.x, 0, static_cast<std::size_t>(region.width));
  }
  const cv::Rect inner = region & cv::Rect(0, 1, depth.cols, depth.rows - 2);
#ifdef DYNFILTER_AVX2
  if (avx2) return depth_lbp_rows<Depth, DepthLbpAvx2<Depth>>(depth, inner, codes);
#endif
  depth_lbp_rows<Depth, DepthLbpPortable<Depth>>(depth, inner, codes);
}

}  // namespace dynfilter::detail
