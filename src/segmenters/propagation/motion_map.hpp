// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Where the pixels of a moved mask come from.

#ifndef DYNFILTER_SRC_SEGMENTERS_PROPAGATION_MOTION_MAP_HPP
#define DYNFILTER_SRC_SEGMENTERS_PROPAGATION_MOTION_MAP_HPP

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "point_flow.hpp"

namespace dynfilter::detail {

/// Maps the pixels of a frame to those of the frame of a mask, known at the nodes of a square grid
/// that covers the moved mask, linear in between, and a plain shift beyond.
class MotionMap {
 public:
  /// The identity, for a mask in this rectangle. `cell_px`: distance of the nodes.
  MotionMap(const cv::Rect& mask, float cell_px);

  /// Where in the mask's frame a point of this frame was.
  cv::Point2f source_of(cv::Point2f point) const;

  /// All moves by this: what the next frame shows at p + shift, this one shows at p.
  void shift(cv::Point2f shift) { origin_ += shift; }

  /// Each point moves by the mean of the motions round it, with weights by a Gaussian of their
  /// distance, and a small one for `common`. In an image of this size. O(motions x nodes within
  /// 3 sigma + nodes).
  void deform(const std::vector<PointMotion>& motions, cv::Point2f common, float sigma_px,
              const cv::Size& image);

  /// The mask at this frame: its pixels in the image, and where the first one lies. The source is
  /// the mask's own part of its frame, at mask_ as it was given. O(area of the grid).
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
