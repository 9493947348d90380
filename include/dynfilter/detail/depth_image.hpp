// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A frame's depth read without asking for its type at every pixel.

#ifndef DYNFILTER_DETAIL_DEPTH_IMAGE_HPP
#define DYNFILTER_DETAIL_DEPTH_IMAGE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <opencv2/core.hpp>

#include "dynfilter/frame.hpp"

namespace dynfilter::detail {

/// Depth in metres, as FrameView::depth_m gives it, with 0 for "no depth".
template <class Depth>
class DepthImage {
 public:
  explicit DepthImage(const FrameView& frame)
      : depth_(frame.depth), metres_per_unit_(frame.depth_scale()) {}

  cv::Size size() const { return depth_.size(); }

  bool contains(int x, int y) const {
    return x >= 0 && y >= 0 && x < depth_.cols && y < depth_.rows;
  }

  /// A depth, or that there is none.
  struct Reading {
    double metres = 0;
    bool is_known = false;
  };

  /// Of any pixel, as FrameView::depth_m tells it. No branch hangs on the depth.
  Reading read(cv::Point pixel) const {
    if (!contains(pixel.x, pixel.y)) return {};
    const Depth value = *at(pixel.x, pixel.y);
    const double metres = static_cast<double>(value) * metres_per_unit_;
    const bool is_finite = metres <= std::numeric_limits<double>::max();
    return {metres, value > 0 && is_finite};
  }

  /// Has the memory fetched that a reading of the pixel, and of those up to `rows` above and below,
  /// will need: many at once, where frames come from a camera and are in no cache.
  void prefetch(cv::Point pixel, int rows) const {
    const std::int64_t x = pixel.x, y = pixel.y;
    if (x < 0 || x >= depth_.cols || y < rows || y >= std::int64_t{depth_.rows} - rows) return;
    const Depth* const value = at(pixel.x, pixel.y);
    for (int row = -rows; row <= rows; ++row) __builtin_prefetch(value + row * row_step());
  }

  /// The pixel must lie in the image.
  double metres(int x, int y) const { return metres_of(*at(x, y)); }

  /// What a pixel's value says, 0 for "no depth".
  double metres_of(Depth value) const {
    const double metres = static_cast<double>(value) * metres_per_unit_;
    if constexpr (std::is_integral<Depth>::value) return metres;
    return metres > 0 && std::isfinite(metres) ? metres : 0;
  }

  /// The pixel must lie in the image; so must what is reached from it by steps and rows.
  const Depth* at(int x, int y) const { return depth_.ptr<Depth>(y) + x; }
  std::ptrdiff_t row_step() const {
    return static_cast<std::ptrdiff_t>(depth_.step[0] / sizeof(Depth));
  }

 private:
  const cv::Mat& depth_;
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
