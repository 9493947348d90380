// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/late_depth.hpp"

#include <algorithm>

#include "dynfilter/moved_depth.hpp"
#include "plugin/host_image.hpp"

namespace dynfilter::detail {

FrameView LateDepth::in_step(const FrameView& frame) {
  constexpr int min_side_px = 64;  // the optical flow needs an image of some size
  constexpr double max_gap_s = 0.2;
  const bool is_known = !frame.image.empty() && !frame.depth.empty() &&
                        std::min(frame.image.cols, frame.image.rows) >= min_side_px;
  if (frames_late_ == 0 || !is_known) return frame;
  cv::Mat grey;
  in_grey(frame.image, grey);
  if (grey.empty()) grey = frame.image.clone();  // the pixels are the host's
  FrameView moved = frame;
  const double gap_s = frame.timestamp_s - last_time_s_;
  if (last_grey_.size() == grey.size() && gap_s > 0 && gap_s <= max_gap_s) {
    if (!optical_flow_) {
      optical_flow_ = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST);
    }
    cv::Mat flow;
    optical_flow_->calc(grey, last_grey_, flow);
    moved.depth = moved_depth(frame.depth, flow, frames_late_);
  }
  last_grey_ = grey;
  last_time_s_ = frame.timestamp_s;
  return moved;
}

}  // namespace dynfilter::detail
