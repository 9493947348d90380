// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// D-LBP codes at points.

#ifndef DYNFILTER_DETAIL_DEPTH_LBP_POINTS_HPP
#define DYNFILTER_DETAIL_DEPTH_LBP_POINTS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_lbp_kernel.hpp"
#include "dynfilter/detail/depth_lbp_points_avx512.hpp"
#include "dynfilter/detail/depth_readings.hpp"
#include "dynfilter/detail/instruction_set.hpp"

#if DYNFILTER_HAS_X86_KERNELS
#include <emmintrin.h>
#endif

namespace dynfilter::detail {

// Which neighbours of a pixel are farther is told by 8 bits in the order that is easiest to get: 0
// to 2 for the upper row, 3 for the one to the left, 4 to 6 for the lower row, 7 for the one to the
// right.

/// The bits of the neighbours clockwise from the top-left one.
constexpr std::array<std::uint8_t, 8> bits_clockwise = {0, 1, 2, 7, 6, 5, 4, 3};

/// Makes codes of them, with the bits of DepthLbpOptions.
class NeighbourCodes {
 public:
  explicit NeighbourCodes(const std::array<std::uint8_t, 8>& bits) : bits_(bits) {
    for (unsigned farther = 0; farther < codes_.size(); ++farther) {
      for (std::size_t k = 0; k < 8; ++k) {
        const unsigned bit = (farther >> bits_clockwise[k] & 1U) << bits[k];
        codes_[farther] = static_cast<std::uint8_t>(codes_[farther] | bit);
      }
    }
  }

  std::uint16_t operator[](unsigned farther) const { return codes_[farther]; }
  const std::array<std::uint8_t, 8>& bits() const { return bits_; }

 private:
  std::array<std::uint8_t, 8> bits_;
  std::array<std::uint8_t, 256> codes_{};
};

/// One neighbour after the other.
template <class Depth>
std::uint8_t farther_plainly(const DepthRows<Depth>& rows, std::ptrdiff_t x,
                             typename DepthBits<Depth>::Type bias) {
  const unsigned code = clockwise_code(rows, x, bias);
  unsigned farther = 0;
  for (unsigned k = 0; k < 8; ++k) farther |= (code >> k & 1U) << bits_clockwise[k];
  return static_cast<std::uint8_t>(farther);
}

#if DYNFILTER_HAS_X86_KERNELS

// For all neighbours at once: SSE2 is what every x86-64 processor has. Of each row four depths may
// be read, the last of which is of no account but must be there.

[[gnu::always_inline]] inline std::uint8_t farther_of_four(const DepthRows<std::uint16_t>& rows,
                                                           std::ptrdiff_t x, std::uint16_t bias) {
  const auto four = [x](const std::uint16_t* row) __attribute__((always_inline)) {
    return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(row + x - 1));
  };
  const __m128i signed_bias = _mm_set1_epi16(static_cast<short>(bias ^ 0x8000));
  const __m128i centre =
      _mm_add_epi16(_mm_set1_epi16(static_cast<short>(rows.middle[x])), signed_bias);
  __m128i neighbours = _mm_unpacklo_epi64(four(rows.upper), four(rows.lower));
  neighbours = _mm_insert_epi16(neighbours, rows.middle[x - 1], 3);
  neighbours = _mm_insert_epi16(neighbours, rows.middle[x + 1], 7);
  const __m128i farther = _mm_cmpgt_epi16(_mm_add_epi16(neighbours, signed_bias), centre);
  return static_cast<std::uint8_t>(_mm_movemask_epi8(_mm_packs_epi16(farther, farther)));
}

[[gnu::always_inline]] inline std::uint8_t farther_of_four(const DepthRows<float>& rows,
                                                           std::ptrdiff_t x, std::uint32_t bias) {
  const __m128i signed_bias = _mm_set1_epi32(static_cast<int>(bias ^ 0x80000000U));
  const auto four = [ x, signed_bias ](const float* row) __attribute__((always_inline)) {
    return _mm_add_epi32(_mm_castps_si128(_mm_loadu_ps(row + x - 1)), signed_bias);
  };
  const __m128i middle = four(rows.middle);
  const __m128i centre = _mm_shuffle_epi32(middle, 0x55);
  const __m128i outer = _mm_packs_epi32(_mm_cmpgt_epi32(four(rows.upper), centre),
                                        _mm_cmpgt_epi32(four(rows.lower), centre));
  const __m128i inner = _mm_packs_epi32(_mm_cmpgt_epi32(middle, centre), _mm_setzero_si128());
  // Those of the rows as they lie, one above the other, and behind them those of the middle.
  const int bits = _mm_movemask_epi8(_mm_packs_epi16(outer, inner));
  return static_cast<std::uint8_t>((bits & 0x77) | (bits >> 5 & 0x08) | (bits >> 3 & 0x80));
}

#else

template <class Depth>
std::uint8_t farther_of_four(const DepthRows<Depth>& rows, std::ptrdiff_t x,
                             typename DepthBits<Depth>::Type bias) {
  return farther_plainly(rows, x, bias);
}

#endif

/// What a depth image has at a pixel, see DepthReadings.
struct PixelReading {
  std::uint32_t depth_bits;
  std::uint16_t code;
};

/// Codes at points of one image. What it knows of the image stands here by value, and a loop over
/// many points should have a copy of its own, because the compiler must take what the loop writes
/// for something that may overwrite a cv::Mat, or this.
template <class Depth>
class DepthLbpPoints {
 public:
  DepthLbpPoints(const cv::Mat& depth, const NeighbourCodes& codes, bool missing_is_farther)
      : data_(depth.data),
        step_(static_cast<std::ptrdiff_t>(depth.step[0])),
        columns_(static_cast<unsigned>(depth.cols)),
        rows_(static_cast<unsigned>(depth.rows)),
        columns_with_four_(columns_ > 3 ? columns_ - 3 : 0),
        inner_rows_(rows_ > 2 ? rows_ - 2 : 0),
        codes_(codes),
        bias_(depth_bias<Depth>(missing_is_farther)) {}

  /// At any pixel. No branch hangs on a depth.
  [[gnu::always_inline]] PixelReading read(int x, int y) const {
    return has_neighbours(x, y) ? read_inner(x, y) : read_near_border(*this, x, y);
  }

  /// Reads at pixels that lie in a rectangle, in the order of their indices. Only that: while no
  /// branch hangs on what is read, the processor works at many pixels at once, whether they are in
  /// its caches or not. Where nothing is known of the rectangle, it is empty.
  void read(const cv::Rect& rectangle, const cv::Point* pixel_of, const std::uint32_t* begin,
            const std::uint32_t* end, [[maybe_unused]] InstructionSet best,
            DepthReadings& readings) const {
    const DepthLbpPoints points = *this;
    std::uint32_t* const bits = readings.depth_bits.data();
    std::uint16_t* const codes = readings.codes.data();
    const auto count = static_cast<std::size_t>(end - begin);
    const auto read_by = [=](const auto& read_at) {
      for (std::size_t i = 0; i < count; ++i) {
        const PixelReading reading = read_at(pixel_of[begin[i]]);
        bits[i] = reading.depth_bits;
        codes[i] = reading.code;
      }
    };
    if (!have_neighbours(rectangle)) {
      return read_by([&](cv::Point pixel) { return points.read(pixel.x, pixel.y); });
    }
#if DYNFILTER_HAS_X86_KERNELS
    if (best >= InstructionSet::avx512) {
      return read_inner_avx512(points, pixel_of, begin, count, bits, codes);
    }
#endif
    read_by([&](cv::Point pixel) { return points.read_inner(pixel.x, pixel.y); });
  }

  static bool has_code(const PixelReading& reading) {
    return reading.code != no_code && are_of_depth<Depth>(reading.depth_bits);
  }

  /// The code of any pixel; nothing if it has none.
  [[gnu::always_inline]] std::optional<std::uint8_t> operator()(int x, int y) const {
    const PixelReading reading = read(x, y);
    const auto code_there = static_cast<std::uint8_t>(reading.code);
    return has_code(reading) ? std::optional<std::uint8_t>(code_there) : std::nullopt;
  }

 private:
  /// Whether the pixel has all eight neighbours, and one more to the right. In one comparison an
  /// axis, to which what lies before the first is a high number.
  [[gnu::always_inline]] bool has_neighbours(int x, int y) const {
    return static_cast<unsigned>(x) - 1U < columns_with_four_ &&
           static_cast<unsigned>(y) - 1U < inner_rows_;
  }

  /// Whether all pixels of a rectangle have.
  bool have_neighbours(const cv::Rect& rectangle) const {
    const std::int64_t right = std::int64_t{rectangle.x} + rectangle.width;
    const std::int64_t bottom = std::int64_t{rectangle.y} + rectangle.height;
    return rectangle.x >= 1 && right <= std::int64_t{columns_with_four_} + 1 && rectangle.y >= 1 &&
           bottom <= std::int64_t{inner_rows_} + 1;
  }

  [[gnu::always_inline]] PixelReading read_inner(int x, int y) const {
    const DepthRows<Depth> rows = rows_at(y);
    return {depth_bits(rows.middle[x]), codes_[farther_of_four(rows, x, bias_)]};
  }

#if DYNFILTER_HAS_X86_KERNELS
  [[gnu::target("avx512f,avx512bw,avx512vl")]] static void read_inner_avx512(
      const DepthLbpPoints points, const cv::Point* pixel_of, const std::uint32_t* indices,
      std::size_t count, std::uint32_t* bits, std::uint16_t* codes) {
    const PointCodesAvx512<Depth> code_at(places_of_bits(points.codes_.bits()), points.bias_);
    for (std::size_t i = 0; i < count; ++i) {
      const cv::Point pixel = pixel_of[indices[i]];
      const DepthRows<Depth> rows = points.rows_at(pixel.y);
      bits[i] = depth_bits(rows.middle[pixel.x]);
      codes[i] = code_at(rows, pixel.x);
    }
  }
#endif

  /// By value, so that a loop may keep its own copy in registers.
  [[gnu::noinline]] static PixelReading read_near_border(const DepthLbpPoints points, int x,
                                                         int y) {
    const unsigned column = static_cast<unsigned>(x), row = static_cast<unsigned>(y);
    if (column >= points.columns_ || row >= points.rows_) return {0, no_code};
    const DepthRows<Depth> rows = points.rows_at(y);
    const std::uint32_t bits = depth_bits(rows.middle[x]);
    const bool is_inner = x > 0 && y > 0 && column + 1 < points.columns_ && row + 1 < points.rows_;
    if (!is_inner) return {bits, no_code};
    return {bits, points.codes_[farther_plainly(rows, x, points.bias_)]};
  }

  [[gnu::always_inline]] DepthRows<Depth> rows_at(int y) const {
    const unsigned char* middle = data_ + y * step_;
    return {reinterpret_cast<const Depth*>(middle - step_), reinterpret_cast<const Depth*>(middle),
            reinterpret_cast<const Depth*>(middle + step_)};
  }

  const unsigned char* data_;
  std::ptrdiff_t step_;
  unsigned columns_, rows_;
  unsigned columns_with_four_, inner_rows_;
  const NeighbourCodes& codes_;
  typename DepthBits<Depth>::Type bias_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_LBP_POINTS_HPP
