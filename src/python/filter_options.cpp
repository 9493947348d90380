// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "bindings.hpp"
#include "dynfilter/dynamic_filter.hpp"
#include "options.hpp"

namespace dynfilter::python {
namespace {

void bind_enums(py::module_& module) {
  py::enum_<CompensationRule>(module, "CompensationRule",
                              "Rule that finds the features that masks missed.")
      .value("depth", CompensationRule::depth, "the object's depth, the default")
      .value("paper", CompensationRule::paper, "the paper's eq. (1)")
      .value("mask", CompensationRule::mask, "masks act alone");
  py::enum_<FloorPolicy>(module, "FloorPolicy",
                         "Policy for frames with fewer features than the floor.")
      .value("report_only", FloorPolicy::report_only, "only report it in the statistics")
      .value("restore_best_scored", FloorPolicy::restore_best_scored,
             "give back the removed features with the lowest scores")
      .value("restore_balanced", FloorPolicy::restore_balanced,
             "give back features where the image has fewest, lowest scores first");
  py::enum_<OutlierRule>(module, "OutlierRule",
                         "Rule that decides which values of a sample are outliers.")
      .value("median_absolute_deviation", OutlierRule::median_absolute_deviation,
             "values farther from the median than outlier_factor x 1.4826 x the MAD")
      .value("interquartile_range", OutlierRule::interquartile_range,
             "values more than outlier_factor x the inter-quartile range outside the quartiles");
  py::enum_<MissingDepth>(module, "MissingDepth",
                          "Verdict on a feature in the box that has no depth, or no D-LBP code.")
      .value("keep", MissingDepth::keep, "a missing value counts as outside the range")
      .value("remove", MissingDepth::remove, "a missing value counts as inside the range");
  py::enum_<MissingNeighbour>(module, "MissingNeighbour",
                              "Meaning of a neighbour without depth when the centre has depth.")
      .value("nearer", MissingNeighbour::nearer, "bit 0: the literal reading")
      .value("farther", MissingNeighbour::farther,
             "bit 1: most missing depth is background in the projector's shadow");
}

void bind_depth_options(py::module_& module) {
  OptionsClass<ObjectDepthOptions>(module, "ObjectDepthOptions",
                                   "Options of how an object's depth is estimated.")
      .field("min_half_width_m", &ObjectDepthOptions::min_half_width_m,
             "half width of the object's depth range around its median, at least, metres")
      .field("max_half_width_m", &ObjectDepthOptions::max_half_width_m,
             "half width of the range, at most, metres")
      .field("min_share", &ObjectDepthOptions::min_share,
             "smallest share of the depths on the mask that the object's cluster must have")
      .field("min_mask_share", &ObjectDepthOptions::min_mask_share,
             "smallest share of its box that a mask must cover to be trusted alone")
      .field("min_box_share", &ObjectDepthOptions::min_box_share,
             "smallest share of the depths in the middle of the box that a cluster must have")
      .field("min_samples", &ObjectDepthOptions::min_samples,
             "smallest number of depths for an estimate")
      .field("max_places", &ObjectDepthOptions::max_places,
             "largest number of places that are read in a mask's rectangle or a box's middle");
  OptionsClass<MaskGapOptions>(module, "MaskGapOptions",
                               "Options of how an object is measured against its mask.")
      .field("row_step_px", &MaskGapOptions::row_step_px, "distance of the rows that are looked at")
      .field("reach_px", &MaskGapOptions::reach_px,
             "search distance outside the mask, and inside it")
      .field("max_gap_px", &MaskGapOptions::max_gap_px, "larger gaps count as this one")
      .field("min_samples", &MaskGapOptions::min_samples,
             "smallest number of places for an estimate")
      .field("min_shift_px", &MaskGapOptions::min_shift_px,
             "smallest shift of the depth that counts");
  using Depth = DepthCompensatorOptions;
  OptionsClass<Depth>(
      module, "DepthCompensatorOptions",
      R"(Options of the rule `depth`. Lengths in pixels are for images 640 pixels wide and scale
with the width; a margin of less than one pixel has no effect.)")
      .field("object_depth", &Depth::object_depth, "how the object's depth is estimated")
      .field("mask_gap", &Depth::mask_gap, "how an object is measured against its mask")
      .field("min_nearness", &Depth::min_nearness,
             "smallest nearness at which a feature without the object's depth is removed")
      .field("min_nearness_if_stale", &Depth::min_nearness_if_stale,
             "smallest nearness if masks are stale")
      .field("reach_px", &Depth::reach_px, "search distance of the nearness")
      .field("box_margin_px", &Depth::box_margin_px,
             "features this far outside the box may belong to the object")
      .field("mask_margin_px", &Depth::mask_margin_px,
             "added to the gap of a fresh mask: features this close to it are removed in any case")
      .field("shadow_px", &Depth::shadow_px,
             "width of the sensor's shadow, a strip without depth beside the object's edge")
      .field("min_nearness_in_shadow", &Depth::min_nearness_in_shadow,
             "smallest nearness for a feature in the shadow; it replaces min_nearness there")
      .field("max_beyond_range_m", &Depth::max_beyond_range_m,
             "length by which a connected part may lie before or behind the object's range, metres")
      .field("max_step_m", &Depth::max_step_m,
             "largest step of depth on the way to such a part, metres")
      .field("min_off_middle_m", &Depth::min_off_middle_m,
             "smallest distance from the range's middle of what may be the surroundings, metres")
      .field("cell_px", &Depth::cell_px, "width of the cells of the watershed")
      .field("stale_age_s", &Depth::stale_age_s, "age from which masks are stale, seconds")
      .field("motion_px_per_s", &Depth::motion_px_per_s,
             "assumed speed of objects in the image, pixels per second")
      .field("max_age_s", &Depth::max_age_s, "masks older than this are treated as fresh, seconds")
      .field("feature_reach_px", &Depth::feature_reach_px,
             "search distance around a feature of unknown depth, without a depth image")
      .field("feature_doubt_px", &Depth::feature_doubt_px,
             "distance of a static feature that is imagined among those around such a feature")
      .field("min_feature_share", &Depth::min_feature_share,
             "smallest share of the object around such a feature at which it is removed");
}

void bind_paper_options(py::module_& module) {
  OptionsClass<RangeEstimatorOptions>(
      module, "RangeEstimatorOptions",
      "Options of how a range of values is estimated from a sample.")
      .field("outlier_rule", &RangeEstimatorOptions::outlier_rule, "which values are rejected")
      .field("outlier_factor", &RangeEstimatorOptions::outlier_factor,
             "factor of the rule; customary: 3 for MAD, 1.5 for the inter-quartile range")
      .field("min_samples", &RangeEstimatorOptions::min_samples, "fewer values give no range")
      .field("expansion", &RangeEstimatorOptions::expansion,
             "added on both sides, in the unit of the values");
  OptionsClass<DepthLbpOptions>(module, "DepthLbpOptions", "Options of DepthLbp.")
      .field("bits", &DepthLbpOptions::bits,
             "bit (0 to 7) of each neighbour, clockwise from the top-left one")
      .field("missing_neighbour", &DepthLbpOptions::missing_neighbour,
             "meaning of a neighbour without depth");
  using Paper = EdgeCompensatorOptions;
  OptionsClass<Paper>(module, "EdgeCompensatorOptions", "Options of the rule `paper`.")
      .field("samples", &Paper::samples, "masked features to estimate the ranges from")
      .field("seed", &Paper::seed, "seed of the random sample")
      .field("depth", &Paper::depth, "estimator of the depth range; expansion in metres")
      .field("code", &Paper::code, "estimator of the code range; expansion in codes")
      .field("depth_lbp", &Paper::depth_lbp, "how codes are computed")
      .field("missing_depth", &Paper::missing_depth, "verdict on features without depth or code");
}

}  // namespace

void bind_filter_options(py::module_& module) {
  bind_enums(module);
  bind_depth_options(module);
  bind_paper_options(module);
}

}  // namespace dynfilter::python
