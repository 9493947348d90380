// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// How an image is placed in a network's input, and how points map between the two. Points are in
// pixels from the upper left corner of the image: pixel (x, y) covers [x, x+1) x [y, y+1), and its
// centre is (x+0.5, y+0.5). With these coordinates, resizing is a mere factor.

#pragma once

#include <opencv2/core.hpp>

#include "detections.hpp"

namespace dynfilter::detail {

/// Maps between image and input, stored both ways so that each is exact.
struct InputPlacement {
  /// A map x' = factor.x x + shift.x, likewise in y.
  struct Map {
    cv::Point2d factor = {1, 1}, shift;

    cv::Point2d operator()(cv::Point2d point) const {
      return {factor.x * point.x + shift.x, factor.y * point.y + shift.y};
    }
  };

  InputPlacement() = default;
  /// Places an image so that it is `placed` in size, and has this corner, in the input.
  InputPlacement(const cv::Size& image_size, const cv::Size& input_size, const cv::Size& placed,
                 const cv::Point& corner);

  cv::Size image;  ///< size of the frame
  cv::Size input;  ///< size of the network's input
  Map to_input;    ///< from points of the image to points of the input
  Map to_image;    ///< from points of the input to points of the image
};

/// An image, or a tensor made of it, and its placement.
struct PlacedImage {
  cv::Mat pixels;
  InputPlacement placement;
};

/// Letterboxes the image: scales it by one factor, as large as fits, into the middle of an input
/// filled with `border`. An odd pixel of border lies below and to the right.
PlacedImage letterbox(const cv::Mat& image, const cv::Size& input, const cv::Scalar& border);

/// Resizes the image to the input without keeping its aspect ratio. The result is CV_32F.
PlacedImage stretch(const cv::Mat& image, const cv::Size& input);

/// Makes a tensor [1, 3, rows, columns] of a placed BGR image: channels in RGB order, each (value -
/// mean) / deviation. `mean` and `deviation` are in RGB order too.
PlacedImage normalized_rgb(const PlacedImage& bgr, const cv::Scalar& mean,
                           const cv::Scalar& deviation);

/// Returns the smallest rectangle of whole image pixels that holds a box of the input, clipped to
/// the image; its area is 0 if the box lies outside.
cv::Rect box_in_image(const Box& box, const InputPlacement& placement);

}  // namespace dynfilter::detail
