// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "point_flow.hpp"

namespace dynfilter::detail {

/// Maps each pixel of a frame to its place in an earlier one. Displacements are known at the nodes
/// of a square grid over the image; they are linear in between, and constant beyond. The grid moves
/// with the object, which keeps its outline sharp.
class MotionMap {
 public:
  /// Makes the identity for images of this size.
  explicit MotionMap(const cv::Size& image);

  /// Returns the place in the earlier frame of a point of this frame.
  cv::Point2f source_of(cv::Point2f point) const { return point + displacement_at(point); }

  /// Moves on to the next frame, by the mean of the motions around each node, with Gaussian weights
  /// of their distance and a small weight for `common`. O(motions x nodes within 3 sigma + nodes).
  void move(const std::vector<PointMotion>& motions, cv::Point2f common, float sigma_px);

  /// Returns the mask at this frame, of the image's size. `mask` lies at `origin` in the earlier
  /// frame. O(pixels).
  cv::Mat1b moved(const cv::Mat& mask, cv::Point origin) const;

 private:
  cv::Point2f node(int x, int y) const {
    return origin_ +
           cv::Point2f(static_cast<float>(x * cell_px_), static_cast<float>(y * cell_px_));
  }
  cv::Point2f displacement_at(cv::Point2f point) const;

  cv::Size image_;
  int cell_px_;         // distance of the nodes
  cv::Point2f origin_;  // of the first one, less than a cell outside the image
  cv::Mat_<cv::Point2f> displacements_;
};

}  // namespace dynfilter::detail
