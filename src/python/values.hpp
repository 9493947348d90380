// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A struct as a class of Python that prints its fields, and can be copied and pickled.

#pragma once

#include <cstddef>
#include <functional>
#include <memory>
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

/// Returns an object's class and these attributes: "ValueRange(lower=0.5, upper=2.5)". Enumerators
/// are written as in Python, Reason.in_mask.
inline std::string text_of(const py::handle& self, const std::vector<std::string>& names) {
  std::string text = type_name(self) + "(";
  const char* separator = "";
  for (const std::string& name : names) {
    const py::object value = self.attr(name.c_str());
    const bool is_enumerator = py::hasattr(py::type::handle_of(value), "__members__");
    text += separator + name + "=" + std::string(is_enumerator ? py::str(value) : py::repr(value));
    separator = ", ";
  }
  return text + ")";
}

/// Returns an index of so many things; negative ones count from the end, as in Python.
inline std::size_t index_of(py::ssize_t i, std::size_t count, const char* what) {
  const auto size = static_cast<py::ssize_t>(count);
  if (i < -size || i >= size) {
    throw py::index_error(detail::concatenate(what, " ", i, " of ", size));
  }
  return static_cast<std::size_t>(i < 0 ? i + size : i);
}

/// Binds fields of a struct, which can be read, copied and pickled; the class has no constructor
/// unless one is added.
template <class Value, class... Bases>
class ValueClass {
 public:
  ValueClass(py::module_& module, const char* name, const char* doc)
      : class_(module, name, doc), fields_(std::make_shared<Fields>()) {
    const auto fields = fields_;
    class_.def("__repr__",
               [fields](const py::object& self) { return text_of(self, fields->printed); });
    class_.def(py::pickle(
        [fields](const Value& value) {
          py::dict state;
          for (const Field& field : fields->all) state[field.name.c_str()] = field.get(value);
          return state;
        },
        [fields](const py::dict& state) {
          Value value;
          for (const Field& field : fields->all) field.set(value, state[field.name.c_str()]);
          return value;
        }));
  }

  /// Adds a field.
  template <class Member>
  ValueClass& field(const char* name, Member Value::*member, const char* doc) {
    class_.def_readonly(name, member, doc);
    keep(name, member);
    return *this;
  }

  /// Adds a field that Python sees as something else: `shown(member)`.
  template <class Member, class Shown>
  ValueClass& field(const char* name, Member Value::*member, const Shown& shown, const char* doc) {
    class_.def_property_readonly(
        name, [member, shown](const Value& value) { return shown(value.*member); }, doc);
    keep(name, member);
    return *this;
  }

  /// Names the attributes that its text has, in place of all fields.
  ValueClass& prints(std::vector<std::string> names) {
    fields_->printed = std::move(names);
    return *this;
  }

  /// The class, to add more to it.
  py::class_<Value, Bases...>& bound() { return class_; }

 private:
  /// Remembers a field that is bound.
  template <class Member>
  void keep(const char* name, Member Value::*member) {
    fields_->printed.emplace_back(name);
    fields_->all.push_back({name, [member](const Value& value) { return py::cast(value.*member); },
                            [member](Value& value, const py::handle& state) {
                              value.*member = state.cast<Member>();
                            }});
  }

  struct Field {
    std::string name;
    std::function<py::object(const Value&)> get;
    std::function<void(Value&, const py::handle&)> set;
  };

  struct Fields {
    std::vector<Field> all;
    std::vector<std::string> printed;
  };

  py::class_<Value, Bases...> class_;
  std::shared_ptr<Fields> fields_;
};

}  // namespace dynfilter::python
