// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURES_HPP
#define DYNFILTER_FEATURES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter {

namespace detail {

/// Rounds a coordinate to the nearest integer, halves up. What is NaN, infinite or beyond the range
/// of int gives the smallest int. Exact in double, where the float sum of 0.49999997 and 0.5 is 1.
inline int round_half_up(float coordinate) {
  constexpr float beyond = 2147483648.0F;
  const double shifted = double{coordinate} + 0.5;
  if (coordinate >= 0 && coordinate < beyond) return static_cast<int>(shifted);
  if (!(coordinate > -beyond && coordinate < 0)) return std::numeric_limits<int>::min();
  return static_cast<int>(std::floor(shifted));
}

}  // namespace detail

/// Returns the nearest pixel of a position: halves are rounded up, nothing is clamped. A position
/// that is NaN, infinite or beyond the range of int gets a pixel that lies in no image.
inline cv::Point nearest_pixel(cv::Point2f position) {
  return {detail::round_half_up(position.x), detail::round_half_up(position.y)};
}

/// View of one frame's features, in raw (distorted) pixels of the image that was segmented. It is a
/// strided view of the caller's keypoints or points: it owns nothing, is cheap to copy, and must
/// not outlive the caller's vector.
class FeaturesView {
 public:
  /// Makes an empty view.
  FeaturesView() = default;

  static_assert(std::is_standard_layout<cv::KeyPoint>::value && offsetof(cv::KeyPoint, pt) == 0,
                "data() is where the position is");

  /// Views `count` keypoints, with their positions and diameters.
  FeaturesView(const cv::KeyPoint* keypoints, std::size_t count)
      : first_(reinterpret_cast<const unsigned char*>(keypoints)),
        stride_(sizeof(cv::KeyPoint)),
        count_(count),
        has_diameters_(true) {}

  /// Views `count` points, as KLT front ends track them. Points have no diameter.
  FeaturesView(const cv::Point2f* points, std::size_t count)
      : first_(reinterpret_cast<const unsigned char*>(points)),
        stride_(sizeof(cv::Point2f)),
        count_(count) {}

  /// Views points that are members of larger structs: the first one, and the number of bytes from
  /// one point to the next.
  FeaturesView(const cv::Point2f* first, std::size_t count, std::size_t stride_bytes)
      : first_(reinterpret_cast<const unsigned char*>(first)),
        stride_(stride_bytes),
        count_(count) {}

  /// Views a vector of keypoints.
  template <class Allocator>
  FeaturesView(const std::vector<cv::KeyPoint, Allocator>& keypoints)
      : FeaturesView(keypoints.data(), keypoints.size()) {}

  /// Views a vector of points.
  template <class Allocator>
  FeaturesView(const std::vector<cv::Point2f, Allocator>& points)
      : FeaturesView(points.data(), points.size()) {}

  /// Number of features.
  std::size_t size() const { return count_; }
  /// Whether there are no features.
  bool empty() const { return count_ == 0; }

  /// Position of feature i, pixels. i must be below size().
  cv::Point2f operator[](std::size_t i) const {
    const unsigned char* element = first_ + i * stride_;
    return has_diameters_ ? reinterpret_cast<const cv::KeyPoint*>(element)->pt
                          : *reinterpret_cast<const cv::Point2f*>(element);
  }

  /// Nearest pixel of feature i, see nearest_pixel.
  cv::Point pixel(std::size_t i) const { return nearest_pixel((*this)[i]); }

  /// Whether the other view shows the same elements in memory.
  bool is_same_view(const FeaturesView& other) const {
    return first_ == other.first_ && stride_ == other.stride_ && count_ == other.count_;
  }

  /// Diameter of feature i in pixels (cv::KeyPoint::size); 0 for points.
  float diameter_px(std::size_t i) const {
    return has_diameters_ ? reinterpret_cast<const cv::KeyPoint*>(first_ + i * stride_)->size
                          : 0.0F;
  }

 private:
  const unsigned char* first_ = nullptr;
  std::size_t stride_ = 0;
  std::size_t count_ = 0;
  bool has_diameters_ = false;
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURES_HPP
