// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What DynamicFilter and MotionFilter share: their options as keyword arguments, and features.

#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "dynfilter/dynamic_filter.hpp"
#include "unlocked.hpp"

namespace dynfilter::python {

/// Features of a call: the caller's points, with depths if they are given.
class Features {
 public:
  /// Throws std::invalid_argument for arrays of another type or shape.
  Features(const py::object& points, const py::object& depths_m, const char* component);

  const FeaturesView& view() const { return view_; }

 private:
  py::array points_;             // kept while the view is in use
  std::vector<float> depths_m_;  // empty without depths
  FeaturesView view_;
};

/// Views the segmentation of a call, none for None.
inline SegmentationView segmentation_view(const std::optional<Segmentation>& segmentation) {
  return segmentation ? SegmentationView(*segmentation) : SegmentationView();
}

/// Makes the options of the stage for masks from its keyword arguments.
MaskCullerOptions culler_options(std::vector<int> dynamic_classes, double margin_px,
                                 const py::object& static_mask);

/// Makes the options of a filter from its keyword arguments.
DynamicFilterOptions filter_options(std::vector<int> dynamic_classes, double margin_px,
                                    const py::object& static_mask, CompensationRule rule,
                                    double half_width_m, std::size_t floor);

/// Explanations of the keyword arguments and of the arguments of `apply`, for docstrings.
extern const char* const filter_options_doc;
extern const char* const apply_doc;

/// Adds what the classes of both filters have. `First` are arguments of the constructor before the
/// options, `component` names the class in errors.
template <class Filter, class... First, class... Names>
void add_filter_members(py::class_<Filter>& bound, const char* component, const Names&... names) {
  bound
      .def(py::init([](First... first, std::vector<int> dynamic_classes, double margin_px,
                       const py::object& static_mask, CompensationRule rule, double half_width_m,
                       std::size_t floor) {
             return std::make_unique<Filter>(
                 first..., filter_options(std::move(dynamic_classes), margin_px, static_mask, rule,
                                          half_width_m, floor));
           }),
           names..., py::kw_only(), py::arg("dynamic_classes") = std::vector<int>{0},
           py::arg("margin_px") = 0.0, py::arg("static_mask") = py::none(),
           py::arg_v("rule", CompensationRule::depth, "CompensationRule.depth"),
           py::arg("half_width_m") = DepthCompensatorOptions().half_width_m, py::arg("floor") = 0,
           filter_options_doc)
      .def(
          "apply",
          [component](Filter& self, const FrameView& frame,
                      const std::optional<Segmentation>& segmentation, const py::object& points,
                      const py::object& depths_m) {
            const Features features(points, depths_m, component);
            const Unlocked unlock;
            return self.apply(frame, segmentation_view(segmentation), features.view());
          },
          py::arg("frame"), py::arg("segmentation"), py::arg("features"),
          py::arg("depths_m") = py::none(), apply_doc);
}

}  // namespace dynfilter::python
