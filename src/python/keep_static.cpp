// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/keep_static.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "dynfilter/detail/errors.hpp"

namespace dynfilter::python {
namespace {

bool is_list(const py::handle& column) {
  return py::isinstance<py::list>(column) || py::isinstance<py::tuple>(column);
}

[[noreturn]] void refuse(std::size_t position, const std::string& got, const std::string& want) {
  detail::throw_misuse("keep_static", detail::concatenate("column ", position, ", ", got), want);
}

/// Checks that a column has one element for each feature. None has no element, as OpenCV's
/// descriptors of no keypoints.
void require_length(const py::handle& column, std::size_t position, std::size_t features) {
  if (column.is_none() && features == 0) return;
  if (!is_list(column) && !py::isinstance<py::array>(column)) {
    refuse(position, "a " + std::string(py::str(py::type::of(column).attr("__name__"))),
           "a NumPy array, a list or a tuple");
  }
  if (!is_list(column) && py::reinterpret_borrow<py::array>(column).ndim() == 0) {
    refuse(position, "an array without rows", "one row for each feature");
  }
  const std::size_t length = py::len(column);
  if (length != features) {
    refuse(position, detail::concatenate("of ", length, " elements"),
           detail::concatenate("one for each feature, ", features));
  }
}

/// Checks that the rows of a column can move: an array that is its own memory row by row.
void require_movable(const py::handle& column, std::size_t position) {
  if (py::isinstance<py::tuple>(column)) refuse(position, "a tuple", "a list for in_place");
  if (is_list(column) || column.is_none()) return;
  const auto array = py::reinterpret_borrow<py::array>(column);
  if (!array.writeable()) refuse(position, "a read-only array", "a writeable one for in_place");
  if (array.dtype().attr("hasobject").cast<bool>()) {
    refuse(position, "an array of objects", "numbers for in_place");
  }
  py::ssize_t dense = array.itemsize();
  for (py::ssize_t axis = array.ndim() - 1; axis > 0; --axis) {
    if (array.shape(axis) != 1 && array.strides(axis) != dense) {
      refuse(position, "an array of scattered rows", "rows of neighbouring values for in_place");
    }
    dense *= array.shape(axis);
  }
  if (array.shape(0) > 1 && array.strides(0) < dense) {
    refuse(position, "an array of overlapping or reversed rows", "rows that follow for in_place");
  }
}

/// Checks that no column is given twice, and that no two share rows that would move twice.
void require_distinct(const py::args& columns, bool in_place) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (columns[i].is_none() || columns[j].is_none()) continue;
      bool are_same = columns[i].ptr() == columns[j].ptr();
      if (in_place && !is_list(columns[i]) && !is_list(columns[j])) {
        are_same =
            py::module_::import("numpy").attr("shares_memory")(columns[i], columns[j]).cast<bool>();
      }
      if (are_same) refuse(i, detail::concatenate("column ", j, " again"), "distinct columns");
    }
  }
}

py::list kept_elements(const FeatureLabels& labels, const py::handle& column) {
  py::list kept;
  std::size_t i = 0;
  for (const py::handle element : column) {
    if (!labels.is_removed(i++)) kept.append(element);
  }
  return kept;
}

/// Moves the kept rows of an array to its front. Returns a view of them.
py::object move_rows(const FeatureLabels& labels, py::array array) {
  std::size_t row_bytes = static_cast<std::size_t>(array.itemsize());
  for (py::ssize_t axis = 1; axis < array.ndim(); ++axis) {
    row_bytes *= static_cast<std::size_t>(array.shape(axis));
  }
  auto* first = static_cast<unsigned char*>(array.mutable_data());
  const auto stride = static_cast<std::size_t>(array.strides(0));
  py::ssize_t kept = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels.is_removed(i)) continue;
    const auto target = static_cast<std::size_t>(kept++);
    if (target != i) std::memcpy(first + target * stride, first + i * stride, row_bytes);
  }
  return array.attr("__getitem__")(py::slice(0, kept, 1));
}

py::tuple keep_static(const FeatureLabels& labels, const py::args& columns, bool in_place) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    require_length(columns[i], i, labels.size());
    if (in_place) require_movable(columns[i], i);
  }
  require_distinct(columns, in_place);
  py::array_t<bool> is_kept(static_cast<py::ssize_t>(labels.size()));
  for (std::size_t i = 0; i < labels.size(); ++i) {
    is_kept.mutable_at(i) = !labels.is_removed(i);
  }
  py::tuple results(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const py::object column = columns[i];
    if (column.is_none()) {
      results[i] = column;
    } else if (is_list(column)) {
      const py::list kept = kept_elements(labels, column);
      if (in_place)
        column.attr("__setitem__")(py::slice(0, static_cast<py::ssize_t>(labels.size()), 1), kept);
      results[i] = in_place ? column : py::object(kept);
    } else if (in_place) {
      results[i] = move_rows(labels, py::reinterpret_borrow<py::array>(column));
    } else {
      results[i] = column.attr("compress")(is_kept, py::arg("axis") = 0);
    }
  }
  return results;
}

}  // namespace

void bind_keep_static(py::module_& module) {
  module.def("keep_static", &keep_static, py::arg("labels"), py::kw_only(),
             py::arg("in_place") = false,
             R"(Removes the removed features from parallel columns, in order.

    points, descriptors = dynfilter.keep_static(labels, points, descriptors)

labels: FeatureLabels of N features
columns: NumPy arrays with N rows, of any type and shape, lists or tuples with N elements
in_place: False: returns a tuple of new arrays and lists; yours stay as they are. True: moves the
    rows within your arrays and returns views of the kept ones, without a copy, and shortens lists.

All columns are checked first: either every column changes or none. Raises ValueError for a column
of another length, one that is given twice, and with in_place one whose rows cannot be moved.)");
  module.def(
      "new_indices",
      [](const FeatureLabels& labels) {
        const std::vector<std::int32_t> indices = new_indices(labels);
        return py::array_t<std::int32_t>(static_cast<py::ssize_t>(indices.size()), indices.data());
      },
      py::arg("labels"),
      R"(Returns the index of each feature after keep_static, or -1 if it was removed. For arrays
that refer to features by index. int32, N.)");
  module.def(
      "kept_below", &kept_below, py::arg("labels"), py::arg("pivot"),
      R"(Returns how many features below index `pivot` are kept. Raises ValueError for a pivot
above the number of features.)");
}

}  // namespace dynfilter::python
