// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A struct of options as a class of Python.

#ifndef DYNFILTER_SRC_PYTHON_OPTIONS_HPP
#define DYNFILTER_SRC_PYTHON_OPTIONS_HPP

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "values.hpp"

namespace dynfilter::python {

/// Binds a struct of options as a ValueClass: its constructor takes every field as keyword
/// argument, fields can be set later, and a name that does not exist is a TypeError that lists
/// those that do.
template <class Options>
class OptionsClass : public ValueClass<Options> {
 public:
  OptionsClass(py::module_& module, const char* name, const char* doc)
      : ValueClass<Options>(module, name, doc),
        names_(std::make_shared<std::vector<std::string>>()) {
    const auto names = names_;
    this->bound().def(
        py::init([names](const py::kwargs& values) { return options_of(*names, values); }),
        "Takes the fields as keyword arguments; the others have their defaults.");
  }

  /// Adds a field.
  template <class Value>
  OptionsClass& field(const char* name, Value Options::*member, const char* doc) {
    this->bound().def_readwrite(name, member, doc);
    this->keep(name, member);
    names_->push_back(name);
    return *this;
  }

 private:
  static Options options_of(const std::vector<std::string>& names, const py::kwargs& values) {
    Options options;
    const py::object self = py::cast(&options, py::return_value_policy::reference);
    for (const auto& [key, value] : values) {
      const std::string name = py::str(key);
      if (std::find(names.begin(), names.end(), name) == names.end()) {
        std::string known;
        for (const std::string& field : names) known += (known.empty() ? "" : ", ") + field;
        throw py::type_error("dynfilter." + type_name(self) + " has no option '" + name +
                             "'; it has " + known);
      }
      py::setattr(self, key, value);
    }
    return options;
  }

  std::shared_ptr<std::vector<std::string>> names_;  // of the fields, in their order
};

}  // namespace dynfilter::python

#endif  // DYNFILTER_SRC_PYTHON_OPTIONS_HPP
