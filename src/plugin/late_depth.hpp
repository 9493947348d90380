// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_LATE_DEPTH_HPP
#define DYNFILTER_SRC_PLUGIN_LATE_DEPTH_HPP

#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>

#include "dynfilter/frame.hpp"

namespace dynfilter::detail {

/// Moves depth that is late to where the image shows the things, along the optical flow from the
/// frame before.
class LateDepth {
 public:
  /// Takes by how many frames depth is late; 0 leaves all frames as they are.
  explicit LateDepth(double frames_late) : frames_late_(frames_late) {}

  /// Returns the frame with its depth moved, if it has image and depth and the frame before is
  /// known.
  FrameView in_step(const FrameView& frame);

 private:
  double frames_late_;
  cv::Ptr<cv::DISOpticalFlow> optical_flow_;  // made when it is needed
  cv::Mat last_grey_;                         // of the frame before
  double last_time_s_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_LATE_DEPTH_HPP
