// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A frame's depth read without asking for its type at every pixel.

#ifndef DYNFILTER_DETAIL_DEPTH_IMAGE_HPP
#define DYNFILTER_DETAIL_DEPTH_IMAGE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_lbp_kernel.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// Some numbers that follow each other.
struct NumberRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;

  bool contains(std::uint32_t number) const { return number - first < count; }
};

/// Whether an index is at least 0 and below a count: in one comparison, to which a negative one is
/// a high number.
inline bool is_below(int index, int count) {
  return static_cast<unsigned>(index) < static_cast<unsigned>(count);
}

/// Depth in metres, as FrameView::depth_m gives it, with 0 for "no depth".
template <class Depth>
class DepthImage {
 public:
  using Value = Depth;

  explicit DepthImage(const FrameView& frame)
      : data_(frame.depth.data),
        row_bytes_(static_cast<std::ptrdiff_t>(frame.depth.step[0])),
        size_(frame.depth.size()),
        metres_per_unit_(frame.depth_scale()) {}

  cv::Size size() const { return size_; }

  bool contains(int x, int y) const {
    return is_below(x, size_.width) && is_below(y, size_.height);
  }

  /// Has the memory fetched that the depths of the pixel and of those up to `rows` above and below
  /// are in: of many at once, where frames come from a camera and are in no cache. Inlined always:
  /// g++ takes what fetches and computes nothing for a function without effect, and leaves calls of
  /// it out.
  [[gnu::always_inline]] void prefetch(cv::Point pixel, int rows) const {
    if (!is_below(pixel.x, size_.width) || pixel.y < rows || pixel.y >= size_.height - rows) return;
    const Depth* const value = at(pixel.x, pixel.y);
    for (int row = -rows; row <= rows; ++row) __builtin_prefetch(value + row * row_step());
  }

  /// The bits of the depths in a range of metres, see DepthBits: they sort like the depths, so that
  /// two searches find the ends.
  NumberRange bits_of(const ValueRange& metres) const {
    const std::uint32_t first =
        first_bits_that([&](double m) { return m >= metres.lower; }, bits_near(metres.lower));
    const std::uint32_t end =
        first_bits_that([&](double m) { return m > metres.upper; }, bits_near(metres.upper));
    return {first, end - first};
  }

  double metres_of_bits(std::uint32_t bits) const {
    const auto depth = static_cast<typename DepthBits<Depth>::Type>(bits);
    Depth value;
    std::memcpy(&value, &depth, sizeof value);
    return static_cast<double>(value) * metres_per_unit_;
  }

  /// The pixel must lie in the image.
  double metres(int x, int y) const { return metres_of(*at(x, y)); }

  /// Whether a pixel's value says a depth.
  bool is_depth(Depth value) const {
    if constexpr (std::is_integral<Depth>::value) return value != 0;
    return metres_of(value) != 0;
  }

  /// What a pixel's value says, 0 for "no depth".
  double metres_of(Depth value) const {
    const double metres = static_cast<double>(value) * metres_per_unit_;
    if constexpr (std::is_integral<Depth>::value) return metres;
    return metres > 0 && std::isfinite(metres) ? metres : 0;
  }

  /// What a value says that was read into a float, rounded to a float.
  float float_metres_of(float value) const {
    return static_cast<float>(double{value} * metres_per_unit_);
  }

  /// The pixel must lie in the image; so must what is reached from it by steps and rows.
  const Depth* at(int x, int y) const {
    return reinterpret_cast<const Depth*>(data_ + y * row_bytes_) + x;
  }
  std::ptrdiff_t row_step() const { return row_bytes_ / std::ptrdiff_t{sizeof(Depth)}; }

 private:
  /// Those of the depth of so many metres, or of another one beside it.
  std::uint32_t bits_near(double metres) const {
    const double units = metres / metres_per_unit_;
    const double most = std::numeric_limits<Depth>::max();
    return depth_bits(static_cast<Depth>(units > 0 ? std::min(units, most) : 0.0));
  }

  /// The first bits of a depth whose metres are far enough, as all that come after them are; where
  /// there are none, what follows those of depths. The guess, if it is a good one, leaves four.
  template <class IsFarEnough>
  std::uint32_t first_bits_that(const IsFarEnough& is_far_enough, std::uint32_t guess) const {
    std::uint32_t begin = 1, end = DepthBits<Depth>::first_beyond;
    if (guess > 2 && !is_far_enough(metres_of_bits(guess - 2))) begin = guess - 1;
    if (guess + 2 < end && is_far_enough(metres_of_bits(guess + 2))) end = guess + 2;
    while (begin < end) {
      const std::uint32_t middle = begin + (end - begin) / 2;
      if (is_far_enough(metres_of_bits(middle))) {
        end = middle;
      } else {
        begin = middle + 1;
      }
    }
    return begin;
  }

  const unsigned char* data_;
  std::ptrdiff_t row_bytes_;
  cv::Size size_;
  double metres_per_unit_;
};

/// Calls the action with the depth image of a valid frame that has one.
template <class Action>
void with_depth_image(const FrameView& frame, const Action& action) {
  if (frame.depth.type() == CV_16UC1) {
    action(DepthImage<std::uint16_t>(frame));
  } else {
    action(DepthImage<float>(frame));
  }
}

/// Lengths in pixels were chosen on images 640 wide; this many pixels of this image are one there.
inline double pixel_scale(const cv::Size& size) { return size.width / 640.0; }

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_IMAGE_HPP
