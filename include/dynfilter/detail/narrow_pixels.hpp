// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Pixels of two 16-bit numbers, so that many fit into a register, and which of them lie in a
// rectangle.

#ifndef DYNFILTER_DETAIL_NARROW_PIXELS_HPP
#define DYNFILTER_DETAIL_NARROW_PIXELS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <numeric>

#include <opencv2/core.hpp>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/instruction_set.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <immintrin.h>
#endif

namespace dynfilter::detail {

/// A pixel whose coordinates are cut off at the ends of 16 bits.
struct NarrowPixel {
  std::int16_t x, y;
};

/// A block of them, from the beginning of a cache line on.
struct alignas(64) NarrowBlock {
  NarrowPixel pixels[block_size];
};

constexpr std::int16_t least_narrow = std::numeric_limits<std::int16_t>::min();
constexpr std::int16_t most_narrow = std::numeric_limits<std::int16_t>::max();

inline NarrowPixel narrowed(const cv::Point& pixel) {
  return {static_cast<std::int16_t>(std::clamp<int>(pixel.x, least_narrow, most_narrow)),
          static_cast<std::int16_t>(std::clamp<int>(pixel.y, least_narrow, most_narrow))};
}

/// Where pixels lie, eight side by side.
struct alignas(32) NarrowBounds {
  static constexpr std::size_t lanes = 8;

  NarrowPixel least[lanes], most[lanes];

  NarrowBounds() {
    std::fill_n(least, lanes, NarrowPixel{most_narrow, most_narrow});
    std::fill_n(most, lanes, NarrowPixel{least_narrow, least_narrow});
  }

  void add(const NarrowPixel& pixel, std::size_t lane) {
    least[lane] = {std::min(least[lane].x, pixel.x), std::min(least[lane].y, pixel.y)};
    most[lane] = {std::max(most[lane].x, pixel.x), std::max(most[lane].y, pixel.y)};
  }

  /// Of all of them. Empty where coordinates were cut off, or where there are no pixels.
  cv::Rect rectangle() const {
    NarrowPixel first = least[0], last = most[0];
    for (std::size_t k = 1; k < lanes; ++k) {
      first = {std::min(first.x, least[k].x), std::min(first.y, least[k].y)};
      last = {std::max(last.x, most[k].x), std::max(last.y, most[k].y)};
    }
    const bool is_exact = first.x > least_narrow && first.y > least_narrow &&
                          last.x < most_narrow && last.y < most_narrow && first.x <= last.x;
    if (!is_exact) return {};
    return {first.x, first.y, last.x - first.x + 1, last.y - first.y + 1};
  }
};

/// The coordinates first to last, both included, along one axis of a rectangle.
class Interval {
 public:
  Interval(std::int64_t first, std::int64_t length)
      // The smallest int is the coordinate of what lies nowhere.
      : first_(std::max(first, std::numeric_limits<int>::min() + std::int64_t{1})),
        last_(first + length - 1) {}

  bool empty() const { return first_ > last_; }
  bool contains(int coordinate) const { return first_ <= coordinate && coordinate <= last_; }

  /// Whether narrow pixels tell the same: those that were cut off stand at the ends, which the
  /// interval does not reach.
  bool is_narrow() const { return first_ > least_narrow && last_ < most_narrow; }

  /// Only of narrow ones that are not empty.
  int narrow_first() const { return static_cast<int>(first_); }
  int narrow_last() const { return static_cast<int>(last_); }

 private:
  std::int64_t first_;
  std::int64_t last_;
};

/// A rectangle of two narrow intervals. A coordinate lies in one of them if its distance from the
/// first, as an unsigned number, which takes what lies before it to the end, is at most the extent.
class NarrowRectangle {
 public:
  NarrowRectangle(const Interval& columns, const Interval& rows)
      : left_(static_cast<std::uint16_t>(columns.narrow_first())),
        top_(static_cast<std::uint16_t>(rows.narrow_first())),
        width_(static_cast<std::uint16_t>(columns.narrow_last() - columns.narrow_first())),
        height_(static_cast<std::uint16_t>(rows.narrow_last() - rows.narrow_first())) {}

  bool contains(const NarrowPixel& pixel) const {
    const auto from = [](std::uint16_t first, std::int16_t coordinate) {
      return static_cast<std::uint16_t>(coordinate - first);
    };
    const int in_columns = from(left_, pixel.x) <= width_ ? 1 : 0;  // and no branch in between
    const int in_rows = from(top_, pixel.y) <= height_ ? 1 : 0;
    return (in_columns & in_rows) != 0;
  }

  /// Column and row as a narrow pixel lies in memory, on machines whose low bytes come first.
  int first_bits() const { return static_cast<int>(std::uint32_t{top_} << 16U | left_); }
  int extent_bits() const { return static_cast<int>(std::uint32_t{height_} << 16U | width_); }

 private:
  std::uint16_t left_, top_;
  std::uint16_t width_, height_;  // less one
};

/// Some blocks of pixels, the first of which is that of feature `first`, or slot.
struct PixelBlocks {
  const NarrowBlock* blocks;
  std::size_t count;
  std::size_t first;
  /// For each block the features that are left out, as bits; or nullptr.
  const std::uint64_t* without;

  std::uint64_t asked_for(std::size_t block) const {
    return without == nullptr ? ~std::uint64_t{0} : ~without[block];
  }
};

// What follows puts the indices of the pixels that lie in a rectangle where `end` points, in their
// order, and returns where they end. What lies behind them, up to a block, may be overwritten.

/// In a loop of a constant number of steps, without a branch, of which compilers make vector code.
inline std::uint32_t* list_inside_portable(const PixelBlocks& all, const NarrowRectangle& rectangle,
                                           std::uint32_t* end) {
  for (std::size_t block = 0; block < all.count; ++block) {
    const NarrowPixel* pixels = all.blocks[block].pixels;
    std::uint8_t is_inside[block_size];
    for (std::size_t k = 0; k < block_size; ++k) {
      is_inside[k] = static_cast<std::uint8_t>(rectangle.contains(pixels[k]));
    }
    for_each_bit(bits_of_bytes(is_inside) & all.asked_for(block), [&](std::size_t bit) {
      *end++ = static_cast<std::uint32_t>(all.first + block * block_size + bit);
    });
  }
  return end;
}

#if DYNFILTER_HAS_X86_KERNELS

inline std::uint32_t* list_inside_sse2(const PixelBlocks& all, const NarrowRectangle& rectangle,
                                       std::uint32_t* end) {
  const __m128i first = _mm_set1_epi32(rectangle.first_bits());
  const __m128i extent = _mm_set1_epi32(rectangle.extent_bits());
  const auto four = [&](const NarrowPixel* from) {
    const __m128i at = _mm_load_si128(reinterpret_cast<const __m128i*>(from));
    const __m128i beyond = _mm_subs_epu16(_mm_sub_epi16(at, first), extent);
    return _mm_cmpeq_epi32(beyond, _mm_setzero_si128());
  };
  const auto sixteen = [&](const NarrowPixel* from) {
    const __m128i low = _mm_packs_epi32(four(from), four(from + 4));
    const __m128i high = _mm_packs_epi32(four(from + 8), four(from + 12));
    const int bits = _mm_movemask_epi8(_mm_packs_epi16(low, high));
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(bits));
  };
  for (std::size_t block = 0; block < all.count; ++block) {
    const NarrowPixel* pixels = all.blocks[block].pixels;
    const std::uint64_t inside = sixteen(pixels) | sixteen(pixels + 16) << 16U |
                                 sixteen(pixels + 32) << 32U | sixteen(pixels + 48) << 48U;
    for_each_bit(inside & all.asked_for(block), [&](std::size_t bit) {
      *end++ = static_cast<std::uint32_t>(all.first + block * block_size + bit);
    });
  }
  return end;
}

#define DYNFILTER_AVX2 gnu::target("avx2,bmi,popcnt")

[[DYNFILTER_AVX2, gnu::always_inline]] inline std::uint32_t inside_avx2(const NarrowPixel* pixels,
                                                                        __m256i first,
                                                                        __m256i extent) {
  __m256i eights[4];
  for (std::size_t k = 0; k < 4; ++k) {
    const __m256i at = _mm256_load_si256(reinterpret_cast<const __m256i*>(pixels + 8 * k));
    const __m256i beyond = _mm256_subs_epu16(_mm256_sub_epi16(at, first), extent);
    eights[k] = _mm256_cmpeq_epi32(beyond, _mm256_setzero_si256());
  }
  const __m256i bytes = _mm256_packs_epi16(_mm256_packs_epi32(eights[0], eights[1]),
                                           _mm256_packs_epi32(eights[2], eights[3]));
  // Packing works in either half of a register on its own: this puts its groups of four in order.
  const __m256i order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
  return static_cast<std::uint32_t>(
      _mm256_movemask_epi8(_mm256_permutevar8x32_epi32(bytes, order)));
}

/// Four bits a step, some of which may not be there: how many there are nobody can foresee.
[[DYNFILTER_AVX2, gnu::always_inline]] inline std::uint32_t* list_bits_avx2(std::uint64_t bits,
                                                                            std::size_t first,
                                                                            std::uint32_t* end) {
  std::uint32_t* const real_end = end + _mm_popcnt_u64(bits);
  while (end < real_end) {
    for (int k = 0; k < 4; ++k) {
      *end++ = static_cast<std::uint32_t>(first + _tzcnt_u64(bits));
      bits = _blsr_u64(bits);
    }
  }
  return real_end;
}

[[DYNFILTER_AVX2]] inline std::uint32_t* list_inside_avx2(const PixelBlocks& all,
                                                          const NarrowRectangle& rectangle,
                                                          std::uint32_t* end) {
  const __m256i first = _mm256_set1_epi32(rectangle.first_bits());
  const __m256i extent = _mm256_set1_epi32(rectangle.extent_bits());
  for (std::size_t block = 0; block < all.count; ++block) {
    const NarrowPixel* pixels = all.blocks[block].pixels;
    const std::uint64_t low = inside_avx2(pixels, first, extent);
    const std::uint64_t high = inside_avx2(pixels + block_size / 2, first, extent);
    end = list_bits_avx2((high << 32U | low) & all.asked_for(block), all.first + block * block_size,
                         end);
  }
  return end;
}

#undef DYNFILTER_AVX2

#define DYNFILTER_AVX512 gnu::target("avx512f,avx512bw,avx512vbmi2,popcnt")

[[DYNFILTER_AVX512, gnu::always_inline]] inline __mmask16 inside_avx512(const NarrowPixel* pixels,
                                                                        __m512i first,
                                                                        __m512i extent) {
  const __m512i at = _mm512_load_si512(pixels);
  const __m512i beyond = _mm512_subs_epu16(_mm512_sub_epi16(at, first), extent);
  return _mm512_testn_epi32_mask(beyond, beyond);
}

/// The bits of a block pick its indices out of the numbers to 63.
[[DYNFILTER_AVX512]] inline std::uint32_t* list_inside_avx512(const PixelBlocks& all,
                                                              const NarrowRectangle& rectangle,
                                                              std::uint32_t* end) {
  constexpr std::size_t lanes = 16;
  constexpr __mmask16 all_lanes = 0xFFFF;
  const __m512i first = _mm512_set1_epi32(rectangle.first_bits());
  const __m512i extent = _mm512_set1_epi32(rectangle.extent_bits());
  alignas(64) std::uint8_t numbers[block_size];
  std::iota(std::begin(numbers), std::end(numbers), std::uint8_t{0});
  const __m512i all_numbers = _mm512_load_si512(numbers);
  __m512i base = _mm512_set1_epi32(static_cast<int>(all.first));
  for (std::size_t block = 0; block < all.count; ++block) {
    const NarrowPixel* pixels = all.blocks[block].pixels;
    const __mmask32 low = _mm512_kunpackw(inside_avx512(pixels + lanes, first, extent),
                                          inside_avx512(pixels, first, extent));
    const __mmask32 high = _mm512_kunpackw(inside_avx512(pixels + 3 * lanes, first, extent),
                                           inside_avx512(pixels + 2 * lanes, first, extent));
    const __mmask64 bits = _mm512_kunpackd(high, low) & all.asked_for(block);
    const auto count = static_cast<std::size_t>(_mm_popcnt_u64(bits));
    __m512i picked = _mm512_maskz_compress_epi8(bits, all_numbers);
    // Mostly there are fewer than sixteen.
    for (std::size_t done = 0;;) {
      __m128i bytes;
      std::memcpy(&bytes, &picked, sizeof bytes);
      const __m512i sixteen = _mm512_maskz_cvtepu8_epi32(all_lanes, bytes);
      _mm512_storeu_si512(end + done, _mm512_add_epi32(base, sixteen));
      done += lanes;
      if (done >= count) break;
      picked = _mm512_maskz_alignr_epi32(all_lanes, picked, picked, 4);
    }
    end += count;
    base = _mm512_add_epi32(base, _mm512_set1_epi32(static_cast<int>(block_size)));
  }
  return end;
}

#undef DYNFILTER_AVX512

#endif

/// By the best instructions up to those of a set.
inline std::uint32_t* list_inside(const PixelBlocks& all, const NarrowRectangle& rectangle,
                                  [[maybe_unused]] InstructionSet best, std::uint32_t* end) {
#if DYNFILTER_HAS_X86_KERNELS
  if (best >= InstructionSet::avx512) return list_inside_avx512(all, rectangle, end);
  if (best >= InstructionSet::avx2) return list_inside_avx2(all, rectangle, end);
  if (best >= InstructionSet::sse2) return list_inside_sse2(all, rectangle, end);
#endif
  return list_inside_portable(all, rectangle, end);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_NARROW_PIXELS_HPP
