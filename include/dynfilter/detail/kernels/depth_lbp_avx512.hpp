// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Dense D-LBP with AVX-512. A comparison yields a mask of one bit per pixel. The eight masks of 64
// pixels are a bit matrix whose columns are the codes, and GFNI transposes it in one instruction.
// The remaining cost is the comparisons, one per cycle on these processors, and the loads, most of
// which cross a cache line. So the kernel walks down columns of pixels, where each load serves
// three rows of codes. Intrinsics, because compilers make the plain C++ version 1.3 to 150 times
// slower, depending on compiler and options.

#ifndef DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_AVX512_HPP
#define DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_AVX512_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <type_traits>

#include "dynfilter/detail/kernels/depth_lbp_strip.hpp"

#if DYNFILTER_HAS_X86_KERNELS

#include <immintrin.h>

namespace dynfilter::detail {

/// Operations that depend on the type of depth.
template <class Depth>
struct Avx512;

template <>
struct Avx512<std::uint16_t> {
  using Mask = __mmask32;
  DYNFILTER_AVX512_INLINE static __m512i broadcast(std::uint16_t value) {
    return _mm512_set1_epi16(static_cast<short>(value));
  }
  DYNFILTER_AVX512_INLINE static __m512i add(__m512i a, __m512i b) {
    return _mm512_add_epi16(a, b);
  }
  DYNFILTER_AVX512_INLINE static Mask greater(__m512i a, __m512i b) {
    return _mm512_cmpgt_epu16_mask(a, b);
  }
};

template <>
struct Avx512<float> {
  using Mask = __mmask16;
  DYNFILTER_AVX512_INLINE static __m512i broadcast(std::uint32_t value) {
    return _mm512_set1_epi32(static_cast<int>(value));
  }
  DYNFILTER_AVX512_INLINE static __m512i add(__m512i a, __m512i b) {
    return _mm512_add_epi32(a, b);
  }
  DYNFILTER_AVX512_INLINE static Mask greater(__m512i a, __m512i b) {
    return _mm512_cmpgt_epu32_mask(a, b);
  }
};

/// Kernel for one type of depth; without a bias the addition is left out.
template <class Depth, bool has_bias>
class DepthLbpAvx512 {
 public:
  static constexpr std::ptrdiff_t columns = 64;

  [[DYNFILTER_AVX512, gnu::always_inline]] explicit DepthLbpAvx512(const DepthLbpRule<Depth>& rule)
      : bias_(Set::broadcast(rule.bias)),
        unbias_(Set::broadcast(rule.unbias())),
        depths_(Set::broadcast(rule.depths)) {
    // Row 7 - b of a bit matrix becomes bit b of its columns.
    alignas(64) std::uint8_t order[64];
    for (std::size_t group = 0; group < 8; ++group) {
      for (std::size_t k = 0; k < 8; ++k) {
        order[group * 8 + 7 - rule.bits[k]] = static_cast<std::uint8_t>(k * 8 + group);
      }
    }
    order_ = _mm512_load_si512(order);
  }

  /// Returns the number of rows to process together. With more rows, fewer are loaded twice. But
  /// addresses that are multiples of 4096 bytes apart share a few places in the first-level cache,
  /// and with long rows the prefetcher cannot keep up with many rows at once.
  static std::ptrdiff_t rows_together(std::ptrdiff_t stride) {
    const std::ptrdiff_t bytes = stride * static_cast<std::ptrdiff_t>(sizeof(Depth));
    if (bytes > 5120) return min_rows;
    const std::ptrdiff_t without_conflict = 16384 / std::gcd(bytes, std::ptrdiff_t{4096});
    return std::clamp(without_conflict, min_rows, max_rows);
  }

  /// Computes the codes of one or more rows, at most `rows_together`.
  DYNFILTER_AVX512_INLINE void operator()(const DepthLbpStrip<Depth>& strip, std::ptrdiff_t y,
                                          std::ptrdiff_t count) const {
    const Depth* from = strip.depth + y * strip.depth_stride;
    std::uint8_t* to = strip.codes + y * strip.codes_stride;
    const Blocks blocks(strip.columns, to);
    const Rows rows = {strip.depth_stride, strip.codes_stride, count};
    alignas(64) Masks masks[max_rows];
    compare_block(from, rows, masks, nullptr);
    for (std::ptrdiff_t i = 1; i < blocks.count; ++i) {
      compare_block(from + blocks.column(i), rows, masks, to + blocks.column(i - 1));
    }
    for (std::ptrdiff_t row = 0; row < count; ++row) {
      store_codes(masks[row], to + blocks.column(blocks.count - 1) + row * strip.codes_stride);
    }
  }

 private:
  using Set = Avx512<Depth>;
  static constexpr std::ptrdiff_t lanes = columns / static_cast<std::ptrdiff_t>(sizeof(Depth));
  static constexpr std::ptrdiff_t min_rows = 4, max_rows = 24;

  /// Blocks that cover a row. The first and the last overlap others, so that all others are stored
  /// within a cache line.
  struct Blocks {
    std::ptrdiff_t second, last, count;

    Blocks(std::ptrdiff_t pixels, const std::uint8_t* codes)
        : second(columns - static_cast<std::ptrdiff_t>(reinterpret_cast<std::uintptr_t>(codes) %
                                                       std::uintptr_t{columns})),
          last(pixels - columns),
          count(1 + (std::max(pixels - second, std::ptrdiff_t{0}) + columns - 1) / columns) {}

    std::ptrdiff_t column(std::ptrdiff_t i) const {
      return i == 0 ? 0 : std::min(second + (i - 1) * columns, last);
    }
  };

  struct Rows {
    std::ptrdiff_t depth_stride, codes_stride, count;
  };

  /// Masks of 64 pixels: which neighbours are farther, clockwise.
  struct Masks {
    std::uint8_t farther[8][8];
  };

  /// Position on the way down a column, which is as wide as one comparison.
  struct Column {
    const Depth* from;
    Masks* masks;
    std::ptrdiff_t byte;         ///< offset in the masks
    std::uint8_t* codes_before;  ///< codes of the pixels whose masks are replaced, if any
  };

  /// Biased depths of a row, each next to its neighbours.
  struct Row {
    __m512i left, middle, right;
  };

  DYNFILTER_AVX512_INLINE __m512i load(const Depth* from) const {
    const __m512i depths = _mm512_loadu_si512(from);
    if constexpr (has_bias) return Set::add(depths, bias_);
    return depths;
  }

  DYNFILTER_AVX512_INLINE Row row(const Depth* from) const {
    return {load(from - 1), load(from), load(from + 1)};
  }

  /// Returns the depths of pixels, with the highest number for "no depth", so that no neighbour is
  /// farther.
  DYNFILTER_AVX512_INLINE __m512i centres(__m512i depths) const {
    if constexpr (std::is_same<Depth, float>::value) {
      const auto has_depth = _mm512_cmpgt_epu32_mask(depths_, _mm512_add_epi32(depths, unbias_));
      return _mm512_mask_mov_epi32(_mm512_set1_epi32(-1), has_depth, depths);
    } else if constexpr (has_bias) {
      return depths;  // the bias has moved 0 there
    } else {
      const __m512i one = _mm512_set1_epi16(1);  // 0 - 1 is the highest number
      return _mm512_max_epu16(depths, _mm512_sub_epi16(depths, one));
    }
  }

  DYNFILTER_AVX512_INLINE static void store(std::uint8_t* to, typename Set::Mask mask) {
    std::memcpy(to, &mask, sizeof mask);
  }

  DYNFILTER_AVX512_INLINE void compare(const Row& upper, const Row& middle, const Row& lower,
                                       Masks& masks, std::ptrdiff_t byte) const {
    const __m512i centre = centres(middle.middle);
    store(masks.farther[0] + byte, Set::greater(upper.left, centre));
    store(masks.farther[1] + byte, Set::greater(upper.middle, centre));
    store(masks.farther[2] + byte, Set::greater(upper.right, centre));
    store(masks.farther[3] + byte, Set::greater(middle.right, centre));
    store(masks.farther[4] + byte, Set::greater(lower.right, centre));
    store(masks.farther[5] + byte, Set::greater(lower.middle, centre));
    store(masks.farther[6] + byte, Set::greater(lower.left, centre));
    store(masks.farther[7] + byte, Set::greater(middle.left, centre));
  }

  /// Computes the masks of a block in all rows, and turns the previous masks into the codes of the
  /// previous block, row by row in between. So masks are stored long before they are loaded; a load
  /// right after several smaller stores to the same place would have to wait for them.
  DYNFILTER_AVX512_INLINE void compare_block(const Depth* from, const Rows& rows, Masks* masks,
                                             std::uint8_t* codes_before) const {
    compare_column({from, masks, 0, codes_before}, rows);
    for (std::ptrdiff_t lane = lanes; lane < columns; lane += lanes) {
      compare_column({from + lane, masks, lane / 8, nullptr}, rows);
    }
  }

  DYNFILTER_AVX512_INLINE void compare_column(Column at, const Rows& rows) const {
    Row a = row(at.from - rows.depth_stride);
    Row b = row(at.from);
    for (std::ptrdiff_t left = rows.count;;) {
      Row c = row(at.from += rows.depth_stride);
      compare_row(a, b, c, at, rows);
      if (--left == 0) return;
      a = row(at.from += rows.depth_stride);
      compare_row(b, c, a, at, rows);
      if (--left == 0) return;
      b = row(at.from += rows.depth_stride);
      compare_row(c, a, b, at, rows);
      if (--left == 0) return;
    }
  }

  DYNFILTER_AVX512_INLINE void compare_row(const Row& upper, const Row& middle, const Row& lower,
                                           Column& at, const Rows& rows) const {
    // Start of this column in the next block.
    _mm_prefetch(reinterpret_cast<const char*>(at.from + columns), _MM_HINT_T0);
    if (at.codes_before != nullptr) {
      store_codes(*at.masks, at.codes_before);
      at.codes_before += rows.codes_stride;
    }
    compare(upper, middle, lower, *at.masks++, at.byte);
  }

  DYNFILTER_AVX512_INLINE void store_codes(const Masks& masks, std::uint8_t* codes) const {
    const __m512i matrices =
        _mm512_maskz_permutexvar_epi8(~__mmask64{0}, order_, _mm512_load_si512(masks.farther));
    const __m512i columns_wanted = _mm512_set1_epi64(static_cast<long long>(0x8040201008040201));
    _mm512_storeu_si512(codes, _mm512_gf2p8affine_epi64_epi8(columns_wanted, matrices, 0));
  }

  __m512i bias_, unbias_, depths_, order_;
};

/// Computes the codes of a strip in bands of rows.
template <class Depth, bool has_bias>
[[DYNFILTER_AVX512]] void depth_lbp_avx512_downwards(const DepthLbpStrip<Depth>& strip,
                                                     const DepthLbpRule<Depth>& rule,
                                                     std::ptrdiff_t band) {
  const DepthLbpAvx512<Depth, has_bias> kernel(rule);
  for (std::ptrdiff_t y = 0; y < strip.rows; y += band) {
    kernel(strip, y, std::min(strip.rows - y, band));
  }
}

/// Computes the codes of a strip of at least 64 columns. The last block overlaps the one before.
/// The upper half is processed downwards and the lower half upwards, because processors prefetch
/// some fifty rows ahead, and so they stay inside the strip. Rows beyond it may be memory that
/// another thread is writing, such as codes that follow the depths in memory; prefetching those
/// made two threads, each with half an image, a fifth slower.
template <class Depth, bool has_bias>
void depth_lbp_avx512(const DepthLbpStrip<Depth>& strip, const DepthLbpRule<Depth>& rule) {
  const std::ptrdiff_t band = DepthLbpAvx512<Depth, has_bias>::rows_together(strip.depth_stride);
  const std::ptrdiff_t bands = (strip.rows + band - 1) / band;
  const std::ptrdiff_t upper_rows = bands / 2 * band;
  if (upper_rows > 0) {
    depth_lbp_avx512_downwards<Depth, has_bias>(upper_part(strip, upper_rows), rule, band);
  }
  depth_lbp_avx512_downwards<Depth, has_bias>(upside_down(lower_part(strip, upper_rows)),
                                              upside_down(rule), band);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_HAS_X86_KERNELS

#endif  // DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_AVX512_HPP
