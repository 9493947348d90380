// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/labels.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// Shows one member of all labels as an array of `Shown`, which is read-only and keeps them alive.
/// Labels never move: a FeatureLabels object of Python keeps its number of features.
template <class Shown, class Value>
py::cpp_function member_view(Value FeatureLabel::*member) {
  static_assert(sizeof(Shown) == sizeof(Value));
  return [member](const py::object& self) {
    const auto& labels = self.cast<const FeatureLabels&>();
    const void* first = labels.empty() ? nullptr : &(labels[0].*member);
    const std::vector<std::size_t> shape = {labels.size()}, strides = {sizeof(FeatureLabel)};
    py::array array(py::dtype::of<Shown>(), shape, strides, first, self);
    array.attr("setflags")(py::arg("write") = false);
    return array;
  };
}

FeatureLabel label_at(const FeatureLabels& labels, py::ssize_t i) {
  return labels[index_of(i, labels.size(), "feature")];
}

void bind_reason(py::module_& module) {
  py::enum_<Reason>(module, "Reason", py::arithmetic(),
                    "Reason of a feature's label. You use `custom` and the values above it.")
      .value("untouched", Reason::untouched, "kept; no stage removed it")
      .value("in_mask", Reason::in_mask,
             "on the mask of a dynamic object, or on the static mask (instance -1)")
      .value("compensated", Reason::compensated, "an edge feature that the mask missed")
      .value("restored", Reason::restored, "removed by one stage and kept by a later one")
      .value("moving", Reason::moving, "it moves, whatever it belongs to")
      .value("still", Reason::still, "kept though on the mask of an object, which stands still")
      .value("custom", Reason::custom, "removed by you")
      // pybind11 finds a number and a member of a scoped enumeration unequal, also in arrays.
      .def(
          "__eq__", [](Reason self, int number) { return static_cast<int>(self) == number; },
          py::is_operator(), py::prepend())
      .def(
          "__ne__", [](Reason self, int number) { return static_cast<int>(self) != number; },
          py::is_operator(), py::prepend());
  py::class_<FeatureLabel> label(module, "FeatureLabel",
                                 "Verdict on one feature. Kept features have scores too: a high\n"
                                 "one was nearly removed.");
  add_text(label, {"score", "instance", "reason", "removed"});
  label.def_readonly("score", &FeatureLabel::score, "0 surely static … 1 surely dynamic")
      .def_readonly("instance", &FeatureLabel::instance,
                    "index into Segmentation.instances; -1 = none")
      .def_readonly("reason", &FeatureLabel::reason, "why")
      .def_readonly("removed", &FeatureLabel::removed, "whether keep_static takes the feature out");
}

}  // namespace

void bind_labels(py::module_& module) {
  bind_reason(module);
  py::class_<FeatureLabels> labels(
      module, "FeatureLabels",
      R"(Verdicts on the features of one frame, in their order, with the frame's statistics.

Its arrays show the labels without a copy, are read-only, and keep the labels alive. Indexed by a
number, it returns a FeatureLabel.)");
  add_text(labels, {"statistics"});
  labels
      .def(py::init<std::size_t, const Segmentation&>(), py::arg("features"),
           py::arg("segmentation"),
           R"(Makes labels of so many features, all untouched. The segmentation gives the instances
that labels may refer to.)")
      .def("__len__", &FeatureLabels::size)
      .def("__getitem__", &label_at, py::arg("feature"))
      .def_property_readonly("removed", member_view<bool>(&FeatureLabel::removed),
                             "whether keep_static takes the feature out: bool, N")
      .def_property_readonly("score", member_view<float>(&FeatureLabel::score),
                             "0 surely static … 1 surely dynamic: float32, N")
      .def_property_readonly("instance", member_view<std::int32_t>(&FeatureLabel::instance),
                             "index into Segmentation.instances; -1 = none: int32, N")
      .def_property_readonly("reason", member_view<std::uint8_t>(&FeatureLabel::reason),
                             "why, see Reason: uint8, N")
      .def_property_readonly(
          "statistics",
          [](const FeatureLabels& self) -> const FrameStatistics& { return self.statistics(); },
          py::return_value_policy::reference_internal, "statistics of the frame")
      .def("remove", &FeatureLabels::remove, py::arg("feature"), py::arg("instance"),
           py::arg("reason"), py::arg("score"),
           R"(Removes a feature in the name of an instance (-1 = none) and counts it.

A feature that is already removed keeps its label. Returns whether this call removed it. Raises
ValueError for a feature or instance that does not exist, for the reasons untouched, restored and still,
and for a score outside 0 to 1.)");
}

}  // namespace dynfilter::python
