// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Functions that add classes and functions to the module, one for each file. Their order in
// module.cpp matters: a type stands before the signatures that name it.

#ifndef DYNFILTER_SRC_PYTHON_BINDINGS_HPP
#define DYNFILTER_SRC_PYTHON_BINDINGS_HPP

#include <pybind11/pybind11.h>

#include "casters.hpp"

namespace dynfilter::python {

namespace py = pybind11;

void bind_frame(py::module_& module);
void bind_instance(py::module_& module);
void bind_segmentation(py::module_& module);
void bind_statistics(py::module_& module);
void bind_labels(py::module_& module);
void bind_keep_static(py::module_& module);
void bind_filter_options(py::module_& module);
void bind_filter(py::module_& module);
void bind_host_masks(py::module_& module);
void bind_segmenters(py::module_& module);
void bind_checks(py::module_& module);
void bind_propagator(py::module_& module);
void bind_networks(py::module_& module);
void bind_motion(py::module_& module);
void bind_sequence(py::module_& module);

}  // namespace dynfilter::python

#endif  // DYNFILTER_SRC_PYTHON_BINDINGS_HPP
