// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "values.hpp"

#include <string>
#include <vector>

namespace dynfilter::python {

std::string type_name(const py::handle& object) {
  return py::str(py::type::handle_of(object).attr("__name__"));
}

std::string text_of(const py::handle& value) {
  const bool is_enumerator = py::hasattr(py::type::handle_of(value), "__members__");
  return is_enumerator ? py::str(value) : py::repr(value);
}

std::string text_of(const py::handle& self, const std::vector<std::string>& names) {
  std::string text = type_name(self) + "(";
  const char* separator = "";
  for (const std::string& name : names) {
    text += separator + name + "=" + text_of(self.attr(name.c_str()));
    separator = ", ";
  }
  return text + ")";
}

}  // namespace dynfilter::python
