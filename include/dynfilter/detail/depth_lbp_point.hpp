// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"

namespace dynfilter::detail {

/// The bits of a depth, which sort like depths. 0 and bits from `beyond` on (infinity, NaN and
/// negative floats) mean "no depth".
template <class Depth>
struct DepthBits {
  static constexpr bool is_float = std::is_same_v<Depth, float>;
  using Type = std::conditional_t<is_float, std::uint32_t, std::uint16_t>;
  static constexpr std::uint32_t beyond = is_float ? 0x7F800000 : 0x10000;
  static std::uint32_t at(const Depth* pixel) {
    Type bits;
    std::memcpy(&bits, pixel, sizeof(bits));
    return bits;
  }
};

/// Returns the D-LBP code of a pixel that has eight neighbours, in rows `stride` pixels apart;
/// nothing without depth. It has no branch, because no processor foresees which neighbours are
/// farther.
template <class Depth>
std::optional<std::uint8_t> depth_lbp_code(const Depth* pixel, std::ptrdiff_t stride) {
  using Bits = DepthBits<Depth>;
  const std::uint32_t centre = Bits::at(pixel), first = centre + 1, count = Bits::beyond - first;
  unsigned code = 0;
  const auto add_bit = [&](const Depth* neighbour) {
    const std::uint32_t bits = Bits::at(neighbour);
    // Floats: farther and below `beyond`, since the difference from nearer ones wraps around.
    code += code + (Bits::is_float ? bits - first < count : bits > centre);
  };
  const Depth *const upper = pixel - stride, *const lower = pixel + stride;
  add_bit(pixel - 1);  // becomes bit 7
  add_bit(lower - 1);
  add_bit(lower);
  add_bit(lower + 1);
  add_bit(pixel + 1);
  add_bit(upper + 1);
  add_bit(upper);
  add_bit(upper - 1);  // bit 0
  std::optional<std::uint8_t> result = static_cast<std::uint8_t>(code);
  if (centre - 1 >= Bits::beyond - 1) result.reset();
  return result;
}

/// Returns the D-LBP code of one pixel, or nothing on the border, outside the image, and without
/// depth.
template <class Depth>
std::optional<std::uint8_t> depth_lbp_code(const cv::Mat& depth, cv::Point pixel) {
  const bool has_neighbours =
      pixel.x >= 1 && pixel.y >= 1 && pixel.x < depth.cols - 1 && pixel.y < depth.rows - 1;
  if (!has_neighbours) return {};
  return depth_lbp_code(depth.ptr<Depth>(pixel.y) + pixel.x,
                        static_cast<std::ptrdiff_t>(depth.step1()));
}

/// Computes the codes of all features. Memory is what takes the time, so pixels are fetched some
/// features ahead.
template <class Depth>
void depth_lbp_codes(const cv::Mat& depth, FeaturesView features,
                     std::optional<std::uint8_t>* codes) {
  constexpr std::size_t ahead = 8;  // With fewer, pixels come late; more gain nothing.
  const Depth* pixels[ahead];       // null without eight neighbours
  const Depth* const first = depth.ptr<Depth>();
  const auto stride = static_cast<std::ptrdiff_t>(depth.step1());
  const double end_x = depth.cols - 1, end_y = depth.rows - 1;
  for (std::size_t i = 0; i < features.size() + ahead; ++i) {
    const Depth*& pixel = pixels[i % ahead];
    if (i >= ahead) codes[i - ahead] = pixel ? depth_lbp_code(pixel, stride) : std::nullopt;
    if (i >= features.size()) continue;
    const double x = double{features[i].x} + 0.5, y = double{features[i].y} + 0.5;
    const bool has_neighbours = x >= 1 && x < end_x && y >= 1 && y < end_y;  // not NaN
    pixel = has_neighbours ? first + static_cast<int>(y) * stride + static_cast<int>(x) : nullptr;
#ifdef __GNUC__
    if (!has_neighbours) continue;
    for (const Depth* row : {pixel - stride, pixel, pixel + stride}) __builtin_prefetch(row);
#endif
  }
}

}  // namespace dynfilter::detail
