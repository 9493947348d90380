// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Functions that add classes and functions to the module, one for each file. Their order in
// module.cpp matters: a type stands before the signatures that name it. Conversions of OpenCV's
// small types: a point is a tuple (x, y), a size (width, height), a box (x, y, width, height).

#pragma once

#include <tuple>
#include <utility>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <opencv2/core.hpp>

namespace pybind11::detail {

inline std::tuple<int, int> ints_of(const cv::Point& point) { return {point.x, point.y}; }
inline std::tuple<int, int> ints_of(const cv::Size& size) { return {size.width, size.height}; }
inline std::tuple<int, int, int, int> ints_of(const cv::Rect& box) {
  return {box.x, box.y, box.width, box.height};
}

template <class Value>
struct ints_caster {
  using Ints = decltype(ints_of(Value()));
  PYBIND11_TYPE_CASTER(Value, const_name("tuple"));

  bool load(handle source, bool convert) {
    make_caster<Ints> ints;
    if (!ints.load(source, convert)) return false;
    value = std::make_from_tuple<Value>(cast_op<Ints>(std::move(ints)));
    return true;
  }

  static handle cast(const Value& from, return_value_policy policy, handle parent) {
    return make_caster<Ints>::cast(ints_of(from), policy, parent);
  }
};

template <>
struct type_caster<cv::Point> : ints_caster<cv::Point> {
  static constexpr auto name = const_name("tuple[int, int]");
};

template <>
struct type_caster<cv::Size> : ints_caster<cv::Size> {
  static constexpr auto name = const_name("tuple[int, int]");
};

template <>
struct type_caster<cv::Rect> : ints_caster<cv::Rect> {
  static constexpr auto name = const_name("tuple[int, int, int, int]");
};

}  // namespace pybind11::detail

namespace dynfilter::python {

namespace py = pybind11;

void bind_frame(py::module_& module);
void bind_instance(py::module_& module);
void bind_segmentation(py::module_& module);
void bind_statistics(py::module_& module);
void bind_labels(py::module_& module);
void bind_filter(py::module_& module);
void bind_host_masks(py::module_& module);
void bind_segmenters(py::module_& module);
void bind_checks(py::module_& module);
void bind_networks(py::module_& module);
void bind_motion(py::module_& module);
void bind_sequence(py::module_& module);

}  // namespace dynfilter::python
