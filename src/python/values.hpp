// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A struct as a class of Python that prints its fields, and can be copied and pickled.

#ifndef DYNFILTER_SRC_PYTHON_VALUES_HPP
#define DYNFILTER_SRC_PYTHON_VALUES_HPP

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings.hpp"

namespace dynfilter::python {

/// Returns the name of an object's class.
std::string type_name(const py::handle& object);

/// Returns an object's text: enumerators as Python writes them, Reason.in_mask, others by repr.
std::string text_of(const py::handle& value);

/// Returns an object's class and these attributes: "ValueRange(lower=0.5, upper=2.5)".
std::string text_of(const py::handle& self, const std::vector<std::string>& names);

/// Binds a struct of which every field is bound. Fields can be read; the class has no constructor
/// unless one is added.
template <class Value>
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
  py::class_<Value>& bound() { return class_; }

 protected:
  /// Remembers a field that is bound.
  template <class Member>
  void keep(const char* name, Member Value::*member) {
    fields_->printed.emplace_back(name);
    fields_->all.push_back({name, [member](const Value& value) { return py::cast(value.*member); },
                            [member](Value& value, const py::handle& state) {
                              value.*member = state.cast<Member>();
                            }});
  }

 private:
  struct Field {
    std::string name;
    std::function<py::object(const Value&)> get;
    std::function<void(Value&, const py::handle&)> set;
  };

  struct Fields {
    std::vector<Field> all;
    std::vector<std::string> printed;
  };

  py::class_<Value> class_;
  std::shared_ptr<Fields> fields_;
};

}  // namespace dynfilter::python

#endif  // DYNFILTER_SRC_PYTHON_VALUES_HPP
