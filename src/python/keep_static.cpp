// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <string>

#include "arrays.hpp"
#include "bindings.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::python {
namespace {

bool is_list(const py::handle& column) {
  return py::isinstance<py::list>(column) || py::isinstance<py::tuple>(column);
}

/// Returns the true number of elements, whatever a subclass's __len__ says.
std::size_t length_of(const py::handle& column) {
  const py::ssize_t length = is_list(column) ? PySequence_Fast_GET_SIZE(column.ptr())
                                             : py::reinterpret_borrow<py::array>(column).shape(0);
  return static_cast<std::size_t>(length);
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
  const std::size_t length = length_of(column);
  if (length != features) {
    refuse(position, detail::concatenate("of ", length, " elements"),
           detail::concatenate("one for each feature, ", features));
  }
}

/// Checks that no column is given twice, which is a slip.
void require_distinct(const py::args& columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!columns[i].is_none() && columns[i].ptr() == columns[j].ptr()) {
        refuse(i, detail::concatenate("column ", j, " again"), "distinct columns");
      }
    }
  }
}

py::list kept_elements(const FeatureLabels& labels, const py::handle& column) {
  py::list kept;  // a subclass's __iter__ is not asked
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels.is_removed(i)) continue;
    kept.append(py::handle(PySequence_Fast_GET_ITEM(column.ptr(), static_cast<py::ssize_t>(i))));
  }
  return kept;
}

py::tuple keep_static(const FeatureLabels& labels, const py::args& columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) require_length(columns[i], i, labels.size());
  require_distinct(columns);
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
      results[i] = kept_elements(labels, column);
    } else {
      results[i] = column.attr("compress")(is_kept, py::arg("axis") = 0);
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
