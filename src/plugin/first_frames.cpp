// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/first_frames.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/feature_floor.hpp"
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

std::vector<std::string> FirstFrames::add(const FrameView& frame, const FrameStatistics& statistics,
                                          bool has_depth) {
  std::vector<std::string> sentences;
  compare_depth(frame, sentences);
  if (frames_ == count) return sentences;
  ++frames_;
  look(frame, statistics, has_depth);
  if (frames_ == count) find_odd(sentences);
  return sentences;
}

/// Speaks as soon as depth is surely out of step by more than half a frame, and compares no more
/// frames then, nor if it is surely in step.
void FirstFrames::compare_depth(const FrameView& frame, std::vector<std::string>& sentences) {
  constexpr double max_frames = 0.5;
  if (compared_ == max_compared || frame.image.empty() || frame.depth.empty()) return;
  estimator_.add(frame);
  if (++compared_ % frames_between_looks != 0) return;
  const std::optional<DepthOffset> offset = estimator_.estimate().offset;
  if (!offset) return;
  const double late = std::abs(offset->frames_late), doubt = 2 * offset->sigma_frames;
  if (late - doubt <= max_frames && late + doubt > max_frames) return;
  compared_ = max_compared;
  if (late <= max_frames) return;
  sentences.push_back(concatenate("dynfilter: depth is ",
                                  offset->frames_late < 0 ? "early" : "late", " by ",
                                  std::round(100 * late) / 100,
                                  " frames, so that people leave features behind: pair the images "
                                  "anew; see Depth in step in the guide for ORB-SLAM"));
}

void FirstFrames::look(const FrameView& frame, const FrameStatistics& statistics, bool has_depth) {
  with_image_ += frame.image.empty() ? 0 : 1;
  with_masks_ += statistics.has_segmentation ? 1 : 0;
  with_depth_ += has_depth ? 1 : 0;
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
  max_kept_ = std::max(max_kept_, statistics.kept());
  suggested_ = std::max(suggested_, suggested_features(statistics, start_features));
}

void FirstFrames::find_odd(std::vector<std::string>& sentences) {
  const std::string first = concatenate("the first ", count, " frames");
  const std::string& file = settings_.file;
  const auto key = [&](const std::string& name) { return settings_.prefix + name + " in " + file; };
  const std::string for_images = settings_.need_of_images();
  if (with_image_ == 0 && !for_images.empty()) {
    sentences.push_back(concatenate("dynfilter: none of ", first, " had an image, which ",
                                    key(for_images),
                                    " needs: call submit() with each frame's image before it is "
                                    "filtered"));
  }
  if (with_masks_ == 0) {
    const bool removes = with_motion_ > 0 || has_static_mask_;
    sentences.push_back(concatenate("dynfilter: none of ", first, " had masks, so that ",
                                    removes ? "only motion or static_mask removed features: does "
                                            : "nothing was removed: does ",
                                    key(settings_.source()),
                                    " give those of this recording, for the times of its frames?"));
  }
  if (motion_ != MotionOutcome::not_run && with_motion_ == 0) {
    sentences.push_back(concatenate(
        "dynfilter: ", key("motion"), " judged nothing in ", first, ": ", name_of(motion_),
        depths_m_.empty() ? ". It needs a depth image with each frame" : ""));
  }
  const double depth_m = depths_m_.empty() ? max_depth_m : quantile_of(depths_m_);
  if (depth_m < min_depth_m || depth_m > max_depth_m) {
    sentences.push_back(concatenate("dynfilter: the median depth of ", first, " is ",
                                    in_two_digits(depth_m), " m: is DepthMapFactor in ", file,
                                    " right? It is 5000 for TUM and BONN, 1000 for millimetres"));
  }
  const double masked = masked_shares_.empty() ? 0 : quantile_of(masked_shares_);
  if (masked > max_masked_share) {
    sentences.push_back(concatenate("dynfilter: ", std::lround(100 * masked),
                                    " % of the features of ", first,
                                    " lie on masks: do these mark the background? Non-zero pixels "
                                    "are persons"));
  }
  if (settings_.is_of_orb_slam && with_depth_ == count && max_kept_ < start_features) {
    sentences.push_back(concatenate(
        "dynfilter: the host cannot begin a map, because none of ", first, " kept the ",
        start_features, " features that it needs (the best kept ", max_kept_,
        "): set ORBextractor.nFeatures in ", file, " to at least ", (suggested_ + 99) / 100 * 100));
  }
}

}  // namespace dynfilter::detail
