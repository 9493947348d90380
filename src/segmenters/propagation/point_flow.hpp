// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Motion of a point between two frames that follow each other.
struct PointMotion {
  cv::Point2f from;  ///< place in the earlier frame, raw pixels
  cv::Point2f to;    ///< place in the later frame, raw pixels

  /// Returns the shift from the earlier frame to the later one, pixels.
  cv::Point2f shift() const { return to - from; }
};

/// Tracks corners of one image into the next. Keeps the pyramid and the corners of the last image
/// only.
class PointFlow {
 public:
  /// Returns the motion of the points that could be followed from the last image into this one;
  /// none without an image or a last image. The motions are in pixels of the full image. The image
  /// has 8 bits and 1, 3 or 4 channels.
  std::vector<PointMotion> track(const cv::Mat& image);

  /// Chooses the points to follow in the image last given to track(), densely in these rectangles
  /// (pixels of the full image).
  void choose_points(const std::vector<cv::Rect>& dense);

  /// Forgets the last image. Must follow an exception of the other functions: pyramids and points
  /// may then be incomplete or of different images.
  void forget() noexcept;

 private:
  void build_pyramid(const cv::Mat& image);
  cv::Point2f to_full(cv::Point2f point) const;

  cv::Mat work_;                  // grey, reduced
  std::vector<cv::Mat> pyramid_;  // of work_, with derivatives
  std::vector<cv::Mat> last_pyramid_;
  cv::Point2f scale_{1, 1};  // full pixels in a pixel of work_
  std::vector<cv::Point2f> points_;
};

}  // namespace dynfilter::detail
