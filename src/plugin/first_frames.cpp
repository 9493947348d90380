// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/first_frames.hpp"

#include <cmath>
#include <optional>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "io/frame_table.hpp"

namespace dynfilter::detail {
namespace {

/// Returns the median of the depths at 16 x 16 places, metres; nothing if none has depth.
std::optional<double> median_depth_m(const FrameView& frame) {
  constexpr int places = 16;  // each way
  std::vector<double> depths_m;
  for (int row = 0; row < places; ++row) {
    for (int column = 0; column < places; ++column) {
      const cv::Point pixel(frame.depth.cols * column / places, frame.depth.rows * row / places);
      if (const auto depth_m = frame.depth_m(pixel)) depths_m.push_back(*depth_m);
    }
  }
  if (depths_m.empty()) return {};
  return quantile_of(depths_m);
}

double in_two_digits(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

}  // namespace

std::vector<std::string> FirstFrames::add(const FrameView& frame,
                                          const FrameStatistics& statistics) {
  if (frames_ == count) return {};
  ++frames_;
  look(frame, statistics);
  if (frames_ < count) return {};
  return findings();
}

void FirstFrames::look(const FrameView& frame, const FrameStatistics& statistics) {
  with_image_ += frame.image.empty() ? 0 : 1;
  with_masks_ += statistics.has_segmentation ? 1 : 0;
  const MotionOutcome outcome = statistics.motion.outcome;
  if (outcome != MotionOutcome::no_image) motion_ = outcome;
  with_motion_ += outcome == MotionOutcome::applied ? 1 : 0;
  const bool by_static_mask = !statistics.has_segmentation && statistics.masked > 0;
  has_static_mask_ = has_static_mask_ || by_static_mask;
  if (const auto depth_m = median_depth_m(frame)) depths_m_.push_back(*depth_m);
  if (statistics.features > 0 && !statistics.instances.empty()) {
    masked_shares_.push_back(static_cast<double>(statistics.masked) /
                             static_cast<double>(statistics.features));
  }
}

std::vector<std::string> FirstFrames::findings() {
  const std::string first = concatenate("the first ", count, " frames");
  std::vector<std::string> sentences;
  if (with_image_ == 0 && !names_.image_key.empty()) {
    sentences.push_back(concatenate("dynfilter: none of ", first, " had an image, which ",
                                    names_.image_key, " in ", names_.file,
                                    " needs: call submit() with each frame's image before it is "
                                    "filtered"));
  }
  if (with_masks_ == 0) {
    const bool removes = with_motion_ > 0 || has_static_mask_;
    sentences.push_back(concatenate("dynfilter: none of ", first, " had masks, so that ",
                                    removes ? "only motion or static_mask removed features: does "
                                            : "nothing was removed: does ",
                                    names_.masks_key, " in ", names_.file,
                                    " give those of this recording, for the times of its frames?"));
  }
  if (motion_ != MotionOutcome::not_run && with_motion_ == 0) {
    sentences.push_back(concatenate(
        "dynfilter: ", names_.motion_key, " in ", names_.file, " judged nothing in ", first, ": ",
        name_of(motion_), depths_m_.empty() ? ". It needs a depth image with each frame" : ""));
  }
  const double depth_m = depths_m_.empty() ? max_depth_m : quantile_of(depths_m_);
  if (depth_m < min_depth_m || depth_m > max_depth_m) {
    sentences.push_back(concatenate("dynfilter: the median depth of ", first, " is ",
                                    in_two_digits(depth_m), " m: is DepthMapFactor in ",
                                    names_.file,
                                    " right? It is 5000 for TUM and BONN, 1000 for millimetres"));
  }
  const double masked = masked_shares_.empty() ? 0 : quantile_of(masked_shares_);
  if (masked > max_masked_share) {
    sentences.push_back(concatenate("dynfilter: ", std::lround(100 * masked),
                                    " % of the features of ", first,
                                    " lie on masks: do these mark the background? Non-zero pixels "
                                    "are persons"));
  }
  return sentences;
}

}  // namespace dynfilter::detail
