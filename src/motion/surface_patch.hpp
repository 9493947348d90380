// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What an image shows of the surface that a feature lies on.

#ifndef DYNFILTER_SRC_MOTION_SURFACE_PATCH_HPP
#define DYNFILTER_SRC_MOTION_SURFACE_PATCH_HPP

#include <array>
#include <cstddef>
#include <optional>

#include <opencv2/core.hpp>

#include "dynfilter/frame.hpp"

namespace dynfilter::detail {

/// Returns the depth of the surface that a pixel lies on, metres: its own, else the farthest of
/// the first depths in eight directions, because what a depth sensor cannot see beside an object
/// lies behind the object. None without a depth within 20 steps, and outside the depth image.
std::optional<double> surface_depth(const FrameView& frame, cv::Point pixel);

/// Patch of 7x7 pixels around a feature without those that lie in front of its surface: beside a
/// person, the wall's pixels count and the person's do not.
class SurfacePatch {
 public:
  /// Takes the feature's frame, its grey image, and the depth of the feature's surface, if known.
  /// Returns nothing if the patch reaches out of the image.
  static std::optional<SurfacePatch> around(const FrameView& frame, const cv::Mat1b& grey,
                                            cv::Point2f feature, std::optional<double> depth_m);

  /// Mean absolute difference of the pixels from their mean, grey levels.
  double contrast() const;

  /// Mean absolute difference from the same pixels around a place of another image, grey levels.
  /// None if the patch reaches out of that image.
  std::optional<double> difference(const cv::Mat1b& other, cv::Point2f place) const;

 private:
  static constexpr int reach_px = 3;
  static constexpr std::size_t side = 2 * reach_px + 1;

  struct Pixel {
    int row, column;
    float brightness;
  };

  std::array<Pixel, side * side> pixels_;
  std::size_t count_ = 0;  // of the pixels that count; the feature's own always does
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_SURFACE_PATCH_HPP
