// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"

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
/// not outlive the caller's vector. It may have a column of depths, for frames without a depth
/// image, see with_depths.
class FeaturesView {
 public:
  /// Makes an empty view.
  FeaturesView() = default;

  static_assert(std::is_standard_layout<cv::KeyPoint>::value && offsetof(cv::KeyPoint, pt) == 0,
                "data() is where the position is");

  /// Views the positions of `count` keypoints.
  FeaturesView(const cv::KeyPoint* keypoints, std::size_t count)
      : first_(reinterpret_cast<const unsigned char*>(keypoints)),
        stride_(sizeof(cv::KeyPoint)),
        count_(count) {}

  /// Views `count` points, as KLT front ends track them.
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

  /// Returns the view with a column of depths, for frames without a depth image: stereo hosts know
  /// them after matching, mono hosts those of matched map points. `depths_m` has one depth for each
  /// feature, metres along the optical axis; 0, negative, NaN and infinite mean "unknown". It is
  /// the caller's and must outlive the view. Throws std::invalid_argument if `count` is not the
  /// number of features.
  FeaturesView with_depths(const float* depths_m, std::size_t count) const {
    if (count != count_) {
      detail::throw_misuse("FeaturesView::with_depths",
                           detail::concatenate(count, " depths and ", count_, " features"),
                           "one depth for each feature");
    }
    FeaturesView view = *this;
    view.depths_m_ = depths_m;
    view.has_depths_ = true;
    return view;
  }

  /// Returns the view with a vector's depths, see above.
  template <class Allocator>
  FeaturesView with_depths(const std::vector<float, Allocator>& depths_m) const {
    return with_depths(depths_m.data(), depths_m.size());
  }

  /// Number of features.
  std::size_t size() const { return count_; }
  /// Whether there are no features.
  bool empty() const { return count_ == 0; }

  /// Position of feature i, pixels. i must be below size().
  cv::Point2f operator[](std::size_t i) const {
    return *reinterpret_cast<const cv::Point2f*>(first_ + i * stride_);
  }

  /// Nearest pixel of feature i, see nearest_pixel.
  cv::Point pixel(std::size_t i) const { return nearest_pixel((*this)[i]); }

  /// Whether there is a column of depths. All of them may be unknown.
  bool has_depths() const { return has_depths_; }

  /// Returns the depth of feature i by the column, metres; nothing if it is unknown, or if there is
  /// no column.
  std::optional<double> depth_m(std::size_t i) const {
    if (!has_depths_) return {};
    const double metres = double{depths_m_[i]};
    if (!(metres > 0) || !std::isfinite(metres)) return {};
    return metres;
  }

 private:
  const unsigned char* first_ = nullptr;
  std::size_t stride_ = 0;
  std::size_t count_ = 0;
  const float* depths_m_ = nullptr;
  bool has_depths_ = false;
};

}  // namespace dynfilter
