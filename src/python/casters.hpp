// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Conversions of OpenCV's small types: a point is a tuple (x, y), a size (width, height), a box
// (x, y, width, height). Every file that binds functions includes this header, so that all convert
// alike.

#ifndef DYNFILTER_SRC_PYTHON_CASTERS_HPP
#define DYNFILTER_SRC_PYTHON_CASTERS_HPP

#include <array>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <opencv2/core.hpp>

namespace pybind11::detail {

template <>
struct type_caster<cv::Point> {
  PYBIND11_TYPE_CASTER(cv::Point, const_name("tuple[int, int]"));

  bool load(handle source, bool convert) {
    make_caster<std::array<int, 2>> numbers;
    if (!numbers.load(source, convert)) return false;
    const auto [x, y] = cast_op<std::array<int, 2>>(numbers);
    value = {x, y};
    return true;
  }

  static handle cast(const cv::Point& point, return_value_policy, handle) {
    return make_tuple(point.x, point.y).release();
  }
};

template <>
struct type_caster<cv::Size> {
  PYBIND11_TYPE_CASTER(cv::Size, const_name("tuple[int, int]"));

  bool load(handle source, bool convert) {
    make_caster<std::array<int, 2>> numbers;
    if (!numbers.load(source, convert)) return false;
    const auto [width, height] = cast_op<std::array<int, 2>>(numbers);
    value = {width, height};
    return true;
  }

  static handle cast(const cv::Size& size, return_value_policy, handle) {
    return make_tuple(size.width, size.height).release();
  }
};

template <>
struct type_caster<cv::Rect> {
  PYBIND11_TYPE_CASTER(cv::Rect, const_name("tuple[int, int, int, int]"));

  bool load(handle source, bool convert) {
    make_caster<std::array<int, 4>> numbers;
    if (!numbers.load(source, convert)) return false;
    const auto [x, y, width, height] = cast_op<std::array<int, 4>>(numbers);
    value = {x, y, width, height};
    return true;
  }

  static handle cast(const cv::Rect& box, return_value_policy, handle) {
    return make_tuple(box.x, box.y, box.width, box.height).release();
  }
};

}  // namespace pybind11::detail

#endif  // DYNFILTER_SRC_PYTHON_CASTERS_HPP
