// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Dense D-LBP in vectors of pixels, by the vector extensions of GCC and Clang: AVX2 where the
// processor that runs the program has it, whatever the program was compiled for. Compilers make
// plain loops 10 to 30 times slower.

#ifndef DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_DENSE_HPP
#define DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_DENSE_HPP

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_lbp_point.hpp"
#include "dynfilter/detail/kernels/instruction_set.hpp"

namespace dynfilter::detail {

/// Computes the codes of a part of a row, one by one.
template <class Depth>
void depth_lbp_plain(const cv::Mat& depth, int y, int first_x, int end_x, cv::Mat& codes) {
  for (int x = first_x; x < end_x; ++x) {
    codes.ptr<std::uint8_t>(y)[x] = depth_lbp_code<Depth>(depth, {x, y}).value_or(0);
  }
}

#ifdef __GNUC__

/// Types of vectors of so many bytes. Outside DepthLbpBlock, because GCC 12 loses attributes there.
template <class Depth, int bytes>
struct DepthVectors {
  using Lane = std::conditional_t<std::is_same_v<Depth, float>, std::int32_t, std::int16_t>;
  using Bits = std::make_unsigned_t<Lane>;
  static constexpr int columns = bytes / sizeof(Depth);

  typedef Lane Lanes __attribute__((vector_size(bytes)));
  typedef Bits BitLanes __attribute__((vector_size(bytes)));
  typedef std::uint16_t Halves __attribute__((vector_size(2 * columns)));
  typedef std::uint8_t Codes __attribute__((vector_size(columns)));
};

/// Computes the codes of the pixels that fit into a vector. Depths are compared by their bits,
/// since positive floats sort like these. A bias moves all values of "no depth", which are 0 and
/// those from `first_beyond` on (infinity, NaN, negative floats), below every depth in the order of
/// signed integers, the only one that AVX2 compares. So a neighbour without depth counts as nearer.
template <class Depth, int bytes>
class DepthLbpBlock {
  using Types = DepthVectors<Depth, bytes>;
  using Lane = typename Types::Lane;
  using Lanes = typename Types::Lanes;

 public:
  static constexpr int columns = Types::columns;

  /// Computes the codes of the pixels from `middle` on. Rows lie `stride` elements apart.
  [[gnu::always_inline]] inline void operator()(const Depth* middle, std::ptrdiff_t stride,
                                                std::uint8_t* to) {
    const Depth *upper = middle - stride, *lower = middle + stride;
    load(middle, centre_);
    codes_ = Lanes{};
    add_bit(1, upper - 1);
    add_bit(2, upper);
    add_bit(4, upper + 1);
    add_bit(8, middle + 1);
    add_bit(16, lower + 1);
    add_bit(32, lower);
    add_bit(64, lower - 1);
    add_bit(128, middle - 1);
    codes_ &= centre_ > static_cast<Lane>(bias);  // the biased 0
    // In two steps, because GCC 12 takes the codes of floats apart in one.
    const auto halves = __builtin_convertvector(codes_, typename Types::Halves);
    const auto codes = __builtin_convertvector(halves, typename Types::Codes);
    std::memcpy(to, &codes, sizeof(codes));
  }

 private:
  static constexpr std::uint32_t first_beyond = std::is_same_v<Depth, float> ? 0x7F800000 : 0x10000;
  static constexpr auto bias =
      static_cast<typename Types::Bits>((1U << (8 * sizeof(Lane) - 1)) - first_beyond);

  [[gnu::always_inline]] static inline void load(const Depth* from, Lanes& lanes) {
    typename Types::BitLanes bits;
    std::memcpy(&bits, from, bytes);
    bits += bias;
    std::memcpy(&lanes, &bits, bytes);
  }

  [[gnu::always_inline]] inline void add_bit(Lane weight, const Depth* neighbours) {
    Lanes lanes;
    load(neighbours, lanes);
    codes_ |= (lanes > centre_) & weight;
  }

  Lanes centre_, codes_;
};

/// Computes the codes of an area whose pixels all have neighbours. The last block of a row overlaps
/// the one before. Returns false if the area is narrower than a block.
template <class Depth, int bytes>
[[gnu::always_inline]] inline bool depth_lbp_blocks(const cv::Mat& depth, const cv::Rect& area,
                                                    cv::Mat& codes) {
  DepthLbpBlock<Depth, bytes> block;
  const auto stride = static_cast<std::ptrdiff_t>(depth.step1());
  const int last = area.width - block.columns;
  if (last < 0) return false;
  for (int y = area.y; y < area.y + area.height; ++y) {
    const Depth* const from = depth.ptr<Depth>(y) + area.x;
    std::uint8_t* const to = codes.ptr<std::uint8_t>(y) + area.x;
    for (int x = 0; x < last; x += block.columns) block(from + x, stride, to + x);
    block(from + last, stride, to + last);
  }
  return true;
}

#endif  // __GNUC__

#ifdef DYNFILTER_AVX2
template <class Depth>
[[DYNFILTER_AVX2]] bool depth_lbp_avx2(const cv::Mat& depth, const cv::Rect& area, cv::Mat& codes) {
  return depth_lbp_blocks<Depth, 32>(depth, area, codes);
}
#endif

/// Computes the codes of a region, which must lie in the image: 0 on the border. With `avx2`, the
/// processor must have it.
template <class Depth>
void dense_depth_lbp(const cv::Mat& depth, const cv::Rect& region, cv::Mat& codes,
                     [[maybe_unused]] bool avx2 = has_avx2()) {
  const cv::Rect inner = region & cv::Rect(1, 1, depth.cols - 2, depth.rows - 2);
  bool is_done = false;
#ifdef DYNFILTER_AVX2
  is_done = avx2 && depth_lbp_avx2<Depth>(depth, inner, codes);
#endif
#ifdef __GNUC__
  is_done = is_done || depth_lbp_blocks<Depth, 16>(depth, inner, codes);
#endif
  const int end_x = region.x + region.width;
  for (int y = region.y; y < region.y + region.height; ++y) {
    const bool has_inner = is_done && y >= inner.y && y < inner.y + inner.height;
    depth_lbp_plain<Depth>(depth, y, region.x, has_inner ? inner.x : end_x, codes);
    if (has_inner) depth_lbp_plain<Depth>(depth, y, inner.x + inner.width, end_x, codes);
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_KERNELS_DEPTH_LBP_DENSE_HPP
