// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The entry of the module _dynfilter. It is initialised in two phases, so that every interpreter of
// the process comes here: pybind11's types belong to one interpreter, and another one that used
// them would crash.

#include <cstddef>
#include <exception>

#include "bindings.hpp"
#include "dynfilter/version.hpp"
#include "unlocked.hpp"

namespace dynfilter::python {
namespace {

[[noreturn]] void* refuse_unmade(std::size_t) {
  throw py::type_error(
      "dynfilter: got an object whose __init__ was not called; want one that its "
      "class made");
}

/// Makes an object of `__new__` alone a TypeError where it is used: pybind11 would hand out memory
/// for it that nobody initialised.
void refuse_unmade_objects(const py::module_& module) {
  for (const auto& item : module.attr("__dict__").cast<py::dict>()) {
    if (!py::isinstance<py::type>(item.second)) continue;
    auto* const type = reinterpret_cast<PyTypeObject*>(item.second.ptr());
    if (auto* const info = py::detail::get_type_info(type)) info->operator_new = &refuse_unmade;
  }
}

void fill(py::module_& module) {
  py::module_::import("numpy");             // its absence shows here, by name
  module.attr("__module__") = "dynfilter";  // the name of the package, in help and errors
  module.attr("__version__") = DYNFILTER_VERSION_STRING;
  bind_frame(module);
  bind_instance(module);
  bind_segmentation(module);
  bind_statistics(module);
  bind_labels(module);
  bind_keep_static(module);
  bind_filter_options(module);
  bind_filter(module);
  bind_host_masks(module);
  bind_segmenters(module);
  bind_checks(module);
  bind_propagator(module);
#ifdef DYNFILTER_HAS_NETWORKS
  bind_networks(module);
#endif
  bind_sequence(module);
  bind_motion(module);  // after the camera of a sequence, which it takes
  refuse_unmade_objects(module);
  py::delattr(module, "__module__");
  py::module_::import("atexit").attr("register")(py::cpp_function(&Unlocked::end_interpreter));
}

/// Fills a module. A second one, of a program that removed the first from sys.modules, gets the
/// first one's names. Returns -1 with a Python error set if it cannot.
int execute(PyObject* module) {
  static PyObject* first = nullptr;
  if (PyInterpreterState_Get() != PyInterpreterState_Main()) {
    PyErr_SetString(PyExc_ImportError,
                    "dynfilter: got a sub-interpreter; want the main interpreter of the process "
                    "(threads and processes may use dynfilter)");
    return -1;
  }
  if (first != nullptr) {
    return PyDict_Update(PyModule_GetDict(module), PyModule_GetDict(first));
  }
  try {
    py::detail::get_internals();
    auto handle = py::reinterpret_borrow<py::module_>(module);
    fill(handle);
  } catch (py::error_already_set& error) {
    error.restore();
    return -1;
  } catch (const std::exception& error) {
    PyErr_SetString(PyExc_ImportError, error.what());
    return -1;
  }
  Py_INCREF(module);
  first = module;
  return 0;
}

}  // namespace
}  // namespace dynfilter::python

extern "C" PYBIND11_EXPORT PyObject* PyInit__dynfilter();

PyObject* PyInit__dynfilter() {
  static PyModuleDef_Slot slots[] = {
      {Py_mod_exec, reinterpret_cast<void*>(&dynfilter::python::execute)}, {0, nullptr}};
  static PyModuleDef definition = {
      PyModuleDef_HEAD_INIT, "_dynfilter", nullptr, 0, nullptr, slots, nullptr, nullptr, nullptr};
  return PyModuleDef_Init(&definition);
}
