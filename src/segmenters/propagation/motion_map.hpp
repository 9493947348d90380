// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Maps each pixel of a moved mask to its source.

#ifndef DYNFILTER_SRC_SEGMENTERS_PROPAGATION_MOTION_MAP_HPP
#define DYNFILTER_SRC_SEGMENTERS_PROPAGATION_MOTION_MAP_HPP

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "point_flow.hpp"

namespace dynfilter::detail {

/// Maps the pixels of a frame to those of the mask's frame. The map is known at the nodes of a
/// square grid that covers the moved mask; it is linear in between, and a plain shift beyond.
class MotionMap {
 public:
  /// Makes the identity for a mask in this rectangle. `cell_px` is the distance of the nodes.
  MotionMap(const cv::Rect& mask, float cell_px);

  /// Returns the place in the mask's frame of a point of this frame.
  cv::Point2f source_of(cv::Point2f point) const;

  /// Shifts the whole map: the next frame shows at p + shift what this one shows at p.
  void shift(cv::Point2f shift) { origin_ += shift; }

  /// Moves each node by the mean of the motions around it, with Gaussian weights of their distance
  /// and a small weight for `common`. `image` is the image's size. O(motions x nodes within 3 sigma
  /// + nodes).
  void deform(const std::vector<PointMotion>& motions, cv::Point2f common, float sigma_px,
              const cv::Size& image);

  /// Returns the mask at this frame: its pixels in the image and, in `origin`, the place of the
  /// first one. `mask` is the mask's own part of its frame, in the rectangle given to the
  /// constructor. O(area of the grid).
  cv::Mat moved(const cv::Mat& mask, const cv::Size& image, cv::Point& origin) const;

 private:
  struct Place;  // in the grid
  Place place_of(cv::Point2f point) const;
  cv::Point2f node(int x, int y) const;
  cv::Rect2f mask_bounds() const;
  void sample_row(const cv::Mat& mask, int y, const cv::Range& columns, std::uint8_t* pixels) const;

  cv::Rect mask_;  // in its own frame
  float cell_px_;
  cv::Point2f origin_;  // of the grid's first node
  cv::Mat_<cv::Point2f> sources_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_SEGMENTERS_PROPAGATION_MOTION_MAP_HPP
