// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_COMPENSATOR_OPTIONS_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_OPTIONS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Options of DepthCompensator.
struct DepthCompensatorOptions {
  /// Half width of the object's depth range around its median, metres: the reach of a person's arms
  /// and legs.
  double half_width_m = 0.45;
  /// Added to the gap of a fresh mask (see MaskGapEstimator), pixels of an image 640 pixels wide:
  /// features this close to the mask are removed in any case.
  double mask_margin_px = 1;
  /// Age from which masks are stale, seconds. A feature on a stale mask is given back unless it
  /// belongs to an object or hides the one of this mask.
  double stale_age_s = 0.02;
  /// Assumed speed of objects, pixels per second of an image 640 pixels wide. The box grows
  /// sideways by this speed times the age of the masks, and by half of that upwards and downwards.
  double motion_px_per_s = 400;
};

/// Constants of DepthCompensator. Lengths in pixels are for images 640 pixels wide and scale with
/// the width; a margin of less than one pixel has no effect. They were chosen on rendered scenes
/// and on recorded ones.
namespace depth_rule {

/// Smallest nearness (see object_nearness) at which a feature without the object's depth is
/// removed. Lower values remove more static features, higher ones leave more dynamic features.
constexpr double min_nearness = 0.55;
/// Smallest nearness if masks are stale, when most of the object may lie beside its mask.
constexpr double min_nearness_if_stale = 0.45;
/// Smallest nearness for a feature that lies within shadow_px of a fresh mask and its gap.
constexpr double min_nearness_in_shadow = 1.0;
/// Width of the sensor's shadow: a strip without depth beside the object's edge, which shows the
/// background.
constexpr double shadow_px = 9;
/// Search distance of object_nearness: wider than the shadow.
constexpr double reach_px = 12;
/// Features this far outside the box may belong to the object: detectors' boxes are not exact.
constexpr double box_margin_px = 6;
/// Length by which a part of the object may lie before or behind the object's range of depth,
/// metres, if it is connected with the object (see DepthWatershed), as an arm is.
constexpr double max_beyond_range_m = 0.3;
/// Largest step of depth on the way to such a part, metres.
constexpr double max_step_m = 0.03;
/// Smallest distance from the middle of the object's range at which a feature may belong to the
/// surroundings instead, metres. On stale masks, only what is behind the middle may.
constexpr double min_off_middle_m = 0.15;
/// Width of the cells of DepthWatershed.
constexpr double cell_px = 24;
/// Masks older than this are treated as fresh, seconds: their time is taken for not set.
constexpr double max_age_s = 1.0;
/// Search distance around a feature of unknown depth, in frames where depth is known at features
/// only (see FeatureDepthCompensator).
constexpr double feature_reach_px = 60;
/// Distance of a static feature that is imagined among those around such a feature. Hosts match
/// fewer features of the background than of a person before it, so that few votes prove little.
constexpr double feature_doubt_px = 24;
/// Smallest share of the object in the features around such a feature at which it is removed.
constexpr double min_feature_share = 0.9;

}  // namespace depth_rule

/// Checks options. Throws std::invalid_argument, in the name of DepthCompensator, for a number
/// outside 0 to 1000000. ObjectDepthEstimator checks half_width_m.
inline void validate(const DepthCompensatorOptions& options) {
  const auto require = [](const char* name, double value) {
    if (value >= 0 && value <= 1e6) return;
    detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value),
                         "a number from 0 to 1000000");
  };
  require("mask_margin_px", options.mask_margin_px);
  require("stale_age_s", options.stale_age_s);
  require("motion_px_per_s", options.motion_px_per_s);
}

/// Returns the age of the masks, seconds; 0 if it is above depth_rule::max_age_s, because their
/// time was not set.
inline double mask_age_s(const FrameView& frame, const Segmentation& segmentation) {
  const double age_s = std::abs(frame.timestamp_s - segmentation.timestamp_s);
  return age_s <= depth_rule::max_age_s ? age_s : 0;
}

/// Returns the part of an image of this size that an object may be in: its box with the margin,
/// grown by the distance that the object may have moved in `age_s` seconds.
inline cv::Rect object_reach(const cv::Rect& box, double age_s,
                             const DepthCompensatorOptions& options, const cv::Size& size) {
  const double motion_px = options.motion_px_per_s * age_s;
  const auto grown = [&](double length_px) {
    // At most from one end of the image to the other.
    return static_cast<std::int64_t>(
        std::lround(std::min(length_px * detail::pixel_scale(size),
                             static_cast<double>(std::max(size.width, size.height)))));
  };
  return detail::clip_grown(box, grown(depth_rule::box_margin_px + motion_px),
                            grown(depth_rule::box_margin_px + motion_px / 2), size);
}

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_OPTIONS_HPP
