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
}

void bind_depth_options(py::module_& module) {
  using Depth = DepthCompensatorOptions;
  OptionsClass<Depth>(
      module, "DepthCompensatorOptions",
      R"(Options of the rule `depth`. Lengths in pixels are for images 640 pixels wide and scale
with the width; a margin of less than one pixel has no effect.)")
      .field("half_width_m", &Depth::half_width_m,
             "how far a person's limbs reach before and behind the median depth, metres")
      .field("mask_margin_px", &Depth::mask_margin_px,
             "added to the gap of a fresh mask: features this close to it are removed in any case")
      .field("stale_age_s", &Depth::stale_age_s, "masks older than this, seconds, are stale")
      .field("motion_px_per_s", &Depth::motion_px_per_s,
             "largest speed of objects in the image, pixels per second")
      .field(
          "min_kept_share", &Depth::min_kept_share,
          "remove only what is sure where a smaller share of the features would be left; 0: never");
}

void bind_paper_options(py::module_& module) {
  OptionsClass<RangeEstimatorOptions>(
      module, "RangeEstimatorOptions",
      "Options of how a range of values is estimated from a sample.")
      .field("outlier_rule", &RangeEstimatorOptions::outlier_rule, "which values are rejected")
      .field("outlier_factor", &RangeEstimatorOptions::outlier_factor,
             "factor of the rule; customary: 3 for MAD, 1.5 for the inter-quartile range")
      .field("expansion", &RangeEstimatorOptions::expansion,
             "added on both sides, in the unit of the values");
  using Paper = EdgeCompensatorOptions;
  OptionsClass<Paper>(module, "EdgeCompensatorOptions", "Options of the rule `paper`.")
      .field("samples", &Paper::samples, "masked features to estimate the ranges from")
      .field("seed", &Paper::seed, "seed of the random sample")
      .field("depth", &Paper::depth, "estimator of the depth range; expansion in metres")
      .field("code", &Paper::code, "estimator of the code range; expansion in codes")
      .field("missing_depth", &Paper::missing_depth, "verdict on features without depth or code");
}

}  // namespace

void bind_filter_options(py::module_& module) {
  bind_enums(module);
  bind_depth_options(module);
  bind_paper_options(module);
}

}  // namespace dynfilter::python
