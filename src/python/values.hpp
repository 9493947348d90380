// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What classes of values share: their texts, and indices as in Python.

#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "dynfilter/detail/errors.hpp"

namespace dynfilter::python {

/// Returns the name of an object's class.
inline std::string type_name(const py::handle& object) {
  return py::str(py::type::handle_of(object).attr("__name__"));
}

/// Gives a class a text of these attributes: "ValueRange(lower=0.5, upper=2.5)". Enumerators are
/// written as in Python, Reason.in_mask.
template <class... Class>
void add_text(py::class_<Class...>& bound, std::vector<std::string> names) {
  bound.def("__repr__", [names = std::move(names)](const py::object& self) {
    std::string text = type_name(self) + "(";
    const char* separator = "";
    for (const std::string& name : names) {
      const py::object value = self.attr(name.c_str());
      const bool is_enumerator = py::hasattr(py::type::handle_of(value), "__members__");
      const py::str shown = is_enumerator ? py::str(value) : py::repr(value);
      text += separator + name + "=" + std::string(shown);
      separator = ", ";
    }
    return text + ")";
  });
}

/// Returns an index of so many things; negative ones count from the end, as in Python.
inline std::size_t index_of(py::ssize_t i, std::size_t count, const char* what) {
  const auto size = static_cast<py::ssize_t>(count);
  if (i < -size || i >= size) {
    throw py::index_error(detail::concatenate(what, " ", i, " of ", size));
  }
  return static_cast<std::size_t>(i < 0 ? i + size : i);
}

}  // namespace dynfilter::python
