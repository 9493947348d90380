// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What DynamicFilter and MotionFilter share: their options as keyword arguments, and features.

#ifndef DYNFILTER_SRC_PYTHON_FILTER_ARGUMENTS_HPP
#define DYNFILTER_SRC_PYTHON_FILTER_ARGUMENTS_HPP

#include <cstddef>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "dynfilter/dynamic_filter.hpp"

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

/// Returns the segmentation of a call, none for None. Throws Python's TypeError for another
/// object, such as an array of masks.
SegmentationView segmentation_of(const py::object& argument, const char* component);

/// Makes the options of a filter from its keyword arguments.
DynamicFilterOptions filter_options(std::vector<int> dynamic_classes, double margin_px,
                                    const py::object& static_mask, CompensationRule rule,
                                    const DepthCompensatorOptions& depth,
                                    const EdgeCompensatorOptions& paper, std::size_t floor);

/// Returns a filter's text: its class and the options that say most.
std::string text_of(const py::handle& self, const DynamicFilterOptions& options);

/// Explanation of the keyword arguments, for docstrings.
extern const char* const filter_options_doc;

/// Explanation of the arguments of `apply`, for docstrings.
extern const char* const apply_doc;

}  // namespace dynfilter::python

#endif  // DYNFILTER_SRC_PYTHON_FILTER_ARGUMENTS_HPP
