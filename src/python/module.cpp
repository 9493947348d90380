// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "bindings.hpp"
#include "dynfilter/version.hpp"
#include "unlocked.hpp"

PYBIND11_MODULE(_dynfilter, module) {
  namespace py = pybind11;
  using namespace dynfilter::python;
  py::module_::import("numpy");             // its absence shows here, by name
  module.attr("__module__") = "dynfilter";  // the name of the package, in help and errors
  module.attr("__version__") = DYNFILTER_VERSION_STRING;
  bind_frame(module);
  bind_instance(module);
  bind_segmentation(module);
  bind_statistics(module);
  bind_labels(module);
  bind_filter(module);
  bind_host_masks(module);
  bind_segmenters(module);
#ifdef DYNFILTER_HAS_NETWORKS
  bind_networks(module);
#endif
  bind_sequence(module);
  bind_checks(module);  // after the camera of a sequence, as what follows
  bind_motion(module);
  py::delattr(module, "__module__");
  py::module_::import("atexit").attr("register")(py::cpp_function(&Unlocked::end_interpreter));
}
