// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOVED_DEPTH_HPP
#define DYNFILTER_MOVED_DEPTH_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {
namespace detail {

template <class Unit>
void read_moved_depth(const cv::Mat& depth, const cv::Mat& flow, double frames_late,
                      cv::Mat& result) {
  for (int y = 0; y < depth.rows; ++y) {
    const cv::Vec2f* const ways = flow.ptr<cv::Vec2f>(y);
    for (int x = 0; x < depth.cols; ++x) {
      const double u = std::floor(x + frames_late * double{ways[x][0]} + 0.5);
      const double v = std::floor(y + frames_late * double{ways[x][1]} + 0.5);
      const bool is_inside = u >= 0 && v >= 0 && u < depth.cols && v < depth.rows;
      const cv::Point from =
          is_inside ? cv::Point(static_cast<int>(u), static_cast<int>(v)) : cv::Point(x, y);
      result.at<Unit>(y, x) = depth.at<Unit>(from);
    }
  }
}

}  // namespace detail

/// Brings depth that is late into step with the colour image, where later depth cannot be waited
/// for: reads each pixel's depth where its surface was when the depth image was made.
///
/// `depth` is CV_16UC1 or CV_32FC1. `flow` is CV_32FC2 of its size: the way from each pixel of the
/// colour image to where it was in the last one, pixels (an optical flow from this image to the
/// last). `frames_late` is DepthOffset::frames_late; 0 changes nothing. Returns a new image. The
/// nearest pixel is read, halves rounded up; where the way ends outside the image or is not finite,
/// the pixel keeps its depth. Edges of the result are no better than those of the flow: images
/// that are paired in step are better.
///
/// Throws std::invalid_argument for other images and for frames_late that is not finite. O(pixels).
inline cv::Mat moved_depth(const cv::Mat& depth, const cv::Mat& flow, double frames_late) {
  const bool is_depth = depth.dims == 2 && (depth.type() == CV_16UC1 || depth.type() == CV_32FC1);
  if (!is_depth || flow.type() != CV_32FC2 || !detail::has_size(flow, depth.size())) {
    detail::throw_misuse(
        "moved_depth",
        detail::concatenate("depth of type ", detail::type_name(depth), " and size ",
                            detail::size_name(depth), ", flow of type ", detail::type_name(flow),
                            " and size ", detail::size_name(flow)),
        "depth CV_16UC1 or CV_32FC1, and flow CV_32FC2 of its size");
  }
  if (!std::isfinite(frames_late)) {
    detail::throw_misuse("moved_depth", detail::concatenate("frames_late = ", frames_late),
                         "a finite number of frames");
  }
  cv::Mat result(depth.size(), depth.type());
  if (depth.type() == CV_16UC1) {
    detail::read_moved_depth<std::uint16_t>(depth, flow, frames_late, result);
  } else {
    detail::read_moved_depth<float>(depth, flow, frames_late, result);
  }
  return result;
}

}  // namespace dynfilter

#endif  // DYNFILTER_MOVED_DEPTH_HPP
