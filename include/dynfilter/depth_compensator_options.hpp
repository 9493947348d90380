// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_COMPENSATOR_OPTIONS_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_OPTIONS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/mask_gap.hpp"
#include "dynfilter/object_depth.hpp"

namespace dynfilter {

/// Options of DepthCompensator. Lengths in pixels are for images 640 pixels wide and scale with the
/// width; a margin of less than one pixel has no effect. The defaults were chosen on rendered
/// and on recorded scenes.
struct DepthCompensatorOptions {
  ObjectDepthOptions object_depth;  ///< how the object's depth is estimated
  MaskGapOptions mask_gap;          ///< how an object is measured against its mask
  /// Smallest nearness (see object_nearness) at which a feature without the object's depth is
  /// removed. Lower values remove more static features, higher ones leave more dynamic features.
  double min_nearness = 0.55;
  /// Smallest nearness if masks are stale, when most of the object may lie beside its mask.
  double min_nearness_if_stale = 0.45;
  double reach_px = 12;      ///< search distance of object_nearness
  double box_margin_px = 6;  ///< features this far outside the box may belong to the object
  /// Added to the gap of a fresh mask (see MaskGapEstimator): features this close to the mask are
  /// removed in any case.
  double mask_margin_px = 1;
  /// Width of the sensor's shadow: a strip without depth beside the object's edge, which shows the
  /// background.
  double shadow_px = 9;
  /// Smallest nearness for a feature without the object's depth that lies within shadow_px of a
  /// fresh mask and its gap. It replaces min_nearness there.
  double min_nearness_in_shadow = 1.0;
  /// Length by which a part of the object may lie before or behind the object's range of depth,
  /// metres, if it is connected with the object (see DepthWatershed).
  double max_beyond_range_m = 0.3;
  /// Largest step of depth on the way to such a part, metres. Values above
  /// DepthWatershed::max_step_m have no effect.
  double max_step_m = 0.03;
  /// Smallest distance from the middle of the object's range at which a feature may belong to the
  /// surroundings instead, metres: it does if it is connected with them by smaller steps. On stale
  /// masks, only what is behind the middle may.
  double min_off_middle_m = 0.15;
  double cell_px = 24;  ///< width of the cells of DepthWatershed
  /// Age from which masks are stale, seconds. A feature on a stale mask is given back unless it
  /// belongs to an object or hides the one of this mask.
  double stale_age_s = 0.02;
  /// Assumed speed of objects in the image, pixels per second. The box grows sideways by this speed
  /// times the age of the masks, and by half of that upwards and downwards.
  double motion_px_per_s = 400;
  /// Masks older than this are treated as fresh, seconds: their time is taken for not set. Raise it
  /// if your masks may be older.
  double max_age_s = 1.0;
  /// Search distance around a feature of unknown depth, in frames where depth is known at features
  /// only (see FeatureDepthCompensator).
  double feature_reach_px = 60;
  /// Distance of a static feature that is imagined among those around such a feature. Hosts match
  /// fewer features of the background than of a person before it, so that few votes prove little.
  double feature_doubt_px = 24;
  /// Smallest share of the object in the features around such a feature at which it is removed;
  /// above 0, at most 1.
  double min_feature_share = 0.9;
};

/// Checks options. Throws std::invalid_argument, in the name of DepthCompensator, for a number
/// outside 0 to 1000000, for a reach_px, cell_px or feature_doubt_px of 0, and for a
/// min_feature_share that is not above 0 and at most 1. The components check object_depth and
/// mask_gap.
inline void validate(const DepthCompensatorOptions& options) {
  const auto refuse = [](const char* name, double value, const char* want) {
    detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value), want);
  };
  const auto require = [&](const char* name, double value) {
    if (!(value >= 0 && value <= 1e6)) refuse(name, value, "a number from 0 to 1000000");
  };
  require("min_nearness", options.min_nearness);
  require("min_nearness_if_stale", options.min_nearness_if_stale);
  require("reach_px", options.reach_px);
  require("box_margin_px", options.box_margin_px);
  require("mask_margin_px", options.mask_margin_px);
  require("shadow_px", options.shadow_px);
  require("min_nearness_in_shadow", options.min_nearness_in_shadow);
  require("max_beyond_range_m", options.max_beyond_range_m);
  require("max_step_m", options.max_step_m);
  require("min_off_middle_m", options.min_off_middle_m);
  require("cell_px", options.cell_px);
  require("stale_age_s", options.stale_age_s);
  require("motion_px_per_s", options.motion_px_per_s);
  require("max_age_s", options.max_age_s);
  require("feature_reach_px", options.feature_reach_px);
  require("feature_doubt_px", options.feature_doubt_px);
  if (options.feature_doubt_px == 0) refuse("feature_doubt_px", 0, "a number above 0");
  if (options.reach_px == 0) refuse("reach_px", 0, "a number above 0");
  if (options.cell_px == 0) refuse("cell_px", 0, "a number above 0");
  if (!(options.min_feature_share > 0 && options.min_feature_share <= 1)) {
    refuse("min_feature_share", options.min_feature_share, "a share above 0, at most 1");
  }
}

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_OPTIONS_HPP
