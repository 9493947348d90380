// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <string>

#include "arrays.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/labels.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

[[noreturn]] void refuse(std::size_t position, const std::string& got, const std::string& want) {
  detail::throw_misuse("keep_static", detail::concatenate("column ", position, ", ", got), want);
}

/// Checks that column `i` is an array, a list or a tuple with one element for each feature, and
/// that it is not given twice, which is a slip. None has no element, as OpenCV's descriptors of no
/// keypoints.
void require_column(const py::args& columns, std::size_t i, std::size_t features) {
  const py::object column = columns[i];
  if (column.is_none() && features == 0) return;
  const bool is_array = py::isinstance<py::array>(column);
  if (!is_array && !py::isinstance<py::list>(column) && !py::isinstance<py::tuple>(column)) {
    refuse(i, "a " + type_name(column), "a NumPy array, a list or a tuple");
  }
  if (is_array && py::reinterpret_borrow<py::array>(column).ndim() == 0) {
    refuse(i, "an array without rows", "one row for each feature");
  }
  const std::size_t length = py::len(column);
  if (length != features) {
    refuse(i, detail::concatenate("of ", length, " elements"),
           detail::concatenate("one for each feature, ", features));
  }
  for (std::size_t j = 0; j < i; ++j) {
    if (column.is(columns[j])) refuse(i, detail::concatenate("column ", j, " again"), "others");
  }
}

py::tuple keep_static(const FeatureLabels& labels, const py::args& columns) {
  py::array_t<bool> is_kept(static_cast<py::ssize_t>(labels.size()));
  for (std::size_t i = 0; i < labels.size(); ++i) is_kept.mutable_at(i) = !labels.is_removed(i);
  for (std::size_t i = 0; i < columns.size(); ++i) require_column(columns, i, labels.size());
  const py::object compress = py::module_::import("itertools").attr("compress");
  py::tuple results(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const py::object column = columns[i];
    if (column.is_none()) {
      results[i] = column;
    } else if (py::isinstance<py::array>(column)) {
      results[i] = column.attr("compress")(is_kept, py::arg("axis") = 0);
    } else {
      results[i] = py::list(compress(column, is_kept));
    }
  }
  return results;
}

}  // namespace

void bind_keep_static(py::module_& module) {
  module.def("keep_static", &keep_static, py::arg("labels"),
             R"(Removes the removed features from parallel columns, in order.

    points, descriptors = dynfilter.keep_static(labels, points, descriptors)

labels: FeatureLabels of N features
columns: NumPy arrays with N rows, of any type and shape, lists or tuples with N elements

Returns a tuple of new arrays and lists; yours stay as they are. Raises ValueError for a column of
another length and for one that is given twice.)");
}

}  // namespace dynfilter::python
