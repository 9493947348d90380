// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// How an image gets into a network's input, and where a point of it lies there. Points are in
// pixels from the upper left corner of the image: pixel (x, y) covers [x, x+1) x [y, y+1), and its
// centre is (x+0.5, y+0.5). Resizing then is a mere factor.

#ifndef DYNFILTER_SRC_NETWORKS_INPUT_PLACEMENT_HPP
#define DYNFILTER_SRC_NETWORKS_INPUT_PLACEMENT_HPP

#include <opencv2/core.hpp>

#include "detections.hpp"

namespace dynfilter::detail {

/// Two points apart, so that both ways are exact.
struct InputPlacement {
  cv::Size image;        ///< of the frame
  cv::Size input;        ///< of the network
  cv::Matx23d to_input;  ///< from points of the image to points of the input
  cv::Matx23d to_image;  ///< and back
};

/// An image with a placement.
struct PlacedImage {
  cv::Mat pixels;
  InputPlacement placement;
};

cv::Point2d transformed(const cv::Matx23d& transform, cv::Point2d point);

/// The image turned so that what is up in the world is up in it, on a canvas that holds all of it,
/// the rest of which has the colour `border`. `roll_rad` is the angle by which the image must be
/// turned clockwise, as one sees it. `placement.input` is the size of the canvas. Multiples of 90°
/// move pixels and change none; 0 shares the pixels.
PlacedImage turn_upright(const cv::Mat& image, double roll_rad, const cv::Scalar& border);

/// The image resized by one factor, as large as fits, in the middle of an input that is filled with
/// `border` (letterboxing). Half a pixel of border that is left over lies below and to the right.
PlacedImage letterbox(const PlacedImage& upright, const cv::Size& input, const cv::Scalar& border);

/// The image resized to the input, whatever its sides. Becomes CV_32F.
PlacedImage stretch(const PlacedImage& upright, const cv::Size& input);

/// A tensor [1, 3, rows, columns] of an image in BGR order: the channels in RGB order, each
/// (value - mean) / deviation, which are in RGB order too.
cv::Mat normalized_rgb(const cv::Mat& bgr, const cv::Scalar& mean, const cv::Scalar& deviation);

/// The smallest rectangle of whole pixels of the image that holds a box of the input, clipped to
/// the image: with area 0 if it lies outside.
cv::Rect box_in_image(const Box& box, const InputPlacement& placement);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_INPUT_PLACEMENT_HPP
