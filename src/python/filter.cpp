// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/overlay.hpp"
#include "filter_arguments.hpp"

namespace dynfilter::python {

const char* const filter_options_doc =
    R"(dynamic_classes: class ids of dynamic objects; 0: COCO's person
margin_px: features this close to a mask are removed too
static_mask: mask of the robot's own parts in every frame, bool or uint8 of the image's size
rule: how the features that masks missed are found
half_width_m: how far a person's limbs reach before and behind the median depth, metres
floor: features that should be left; a frame with fewer is starved; 0 = no check

Raises ValueError for options out of range.)";

const char* const apply_doc = R"(Returns the labels of the frame's features.

frame: FrameView
segmentation: Segmentation of the frame, or None if no masks are known
features: N x 2 (or N x 1 x 2, as OpenCV has them), float32: x and y in raw pixels of the image that
    was segmented; the rows may have any distance; None: no features
depths_m: N, the features' depths in metres, 0 or NaN = unknown, for compensation in frames
    without a depth image; None = not known. These are copied.

Raises ValueError for malformed input. The interpreter's lock is released meanwhile.)";

Features::Features(const py::object& points, const py::object& depths_m, const char* component)
    : points_(points.is_none() ? py::array() : array_from(points)),
      view_(features_from(points_, component)) {
  if (depths_m.is_none()) return;
  const auto numbers = numbers_from(depths_m, {component, "depths_m"});
  if (numbers.ndim() != 1 || static_cast<std::size_t>(numbers.size()) != view_.size()) {
    detail::throw_misuse(component, detail::concatenate("depths_m of ", description(numbers)),
                         detail::concatenate("one for each feature, ", view_.size()));
  }
  depths_m_.assign(numbers.data(), numbers.data() + numbers.size());
  view_ = view_.with_depths(depths_m_);
}

MaskCullerOptions culler_options(std::vector<int> dynamic_classes, double margin_px,
                                 const py::object& static_mask) {
  MaskCullerOptions options;
  options.dynamic_classes = std::move(dynamic_classes);
  options.margin_px = margin_px;
  options.static_mask = matrix_from(static_mask, Pixels::mask, {"MaskCuller", "a static_mask"});
  return options;
}

DynamicFilterOptions filter_options(std::vector<int> dynamic_classes, double margin_px,
                                    const py::object& static_mask, CompensationRule rule,
                                    double half_width_m, std::size_t floor) {
  DynamicFilterOptions options;
  options.mask_culler = culler_options(std::move(dynamic_classes), margin_px, static_mask);
  options.compensator.rule = rule;
  options.compensator.depth.half_width_m = half_width_m;
  options.feature_floor = floor;
  return options;
}

namespace {

py::array draw(const py::object& image, const std::optional<Segmentation>& segmentation,
               const py::object& points, const FeatureLabels& labels) {
  const cv::Mat pixels = matrix_from(image, Pixels::image, {"draw_overlay", "an image"});
  const Features features(points, py::none(), "draw_overlay");
  cv::Mat drawing;
  {
    const Unlocked unlock;
    drawing = draw_overlay(pixels, segmentation.value_or(Segmentation()), features.view(), labels);
  }
  return array_of(drawing, true).value();
}

}  // namespace

void bind_filter(py::module_& module) {
  py::enum_<CompensationRule>(module, "CompensationRule",
                              "Rule that finds the features that masks missed.")
      .value("depth", CompensationRule::depth, "the object's depth, the default")
      .value("paper", CompensationRule::paper, "the paper's eq. (1)")
      .value("mask", CompensationRule::mask, "masks act alone");
  py::class_<DynamicFilter> filter(
      module, "DynamicFilter",
      R"(Filter of the paper's section 3. It removes the features on prior dynamic objects (3.1),
then the features that the masks missed (3.2): by the object's depth, CompensationRule.depth, or
by the paper's own rule, CompensationRule.paper.

    filter = dynfilter.DynamicFilter(dynamic_classes=[0], margin_px=3)
    labels = filter.apply(frame, segmentation, points)

Without a depth image or depths_m only masks act. Two filters share nothing. Many threads may
use one filter at once.)");
  add_filter_members(filter, "DynamicFilter");

  module.def(
      "draw_overlay", &draw, py::arg("image"), py::arg("segmentation"), py::arg("features"),
      py::arg("labels"),
      R"(Draws what the filter did, for a person to look at. Each reason has its own colour and
shape (kept: blue ring, in mask: vermilion cross, compensated: yellow diamond, restored: green ring,
moving: orange triangle, still: white ring, custom: purple square).

image: uint8, grey or BGR, not changed; segmentation: a Segmentation, or None
Returns an uint8 image, BGR, of the same width, with the legend added below.)");
}

}  // namespace dynfilter::python
