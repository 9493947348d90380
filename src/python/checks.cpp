// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynfilter/diagnosis/input_checks.hpp"
#include "filter_arguments.hpp"
#include "values.hpp"

namespace dynfilter::python {

void bind_checks(py::module_& module) {
  py::class_<InputFinding> finding(module, "InputFinding", "Finding of InputChecks.");
  add_text(finding, {"check", "sentence"});
  finding.def_readonly("check", &InputFinding::check, "name of the check, such as depth_unit")
      .def_readonly("sentence", &InputFinding::sentence, "what is wrong, and what to do")
      .def_readonly("is_hopeless", &InputFinding::is_hopeless,
                    "no result can be right before it is mended");
  py::class_<InputChecks>(module, "InputChecks",
                          R"(Checks what goes into a filter, without ground truth: camera, times,
images, depth, masks and features. Each check needs 8 frames.

    checks = dynfilter.InputChecks()
    for frame in sequence:
        checks.add(frame, masks.segment(frame), points)
    for finding in checks.findings():
        print(finding.sentence)
)")
      .def(py::init([](std::vector<int> dynamic_classes, std::size_t wanted_features) {
             InputChecksOptions options;
             options.dynamic_classes = std::move(dynamic_classes);
             options.wanted_features = wanted_features;
             return InputChecks(options);
           }),
           py::kw_only(), py::arg("dynamic_classes") = std::vector<int>{0},
           py::arg("wanted_features") = 0,
           R"(dynamic_classes: class ids of dynamic objects
wanted_features: number asked for in each frame; 0: unknown)")
      .def("note_camera", &InputChecks::note_camera, py::arg("camera"), "Notes the camera.")
      .def("note_mask_values", &InputChecks::note_mask_values, py::arg("values"),
           "Notes MaskFolderSegmenter.values().")
      .def(
          "add",
          [](InputChecks& self, const FrameView& frame,
             const std::optional<Segmentation>& segmentation, const py::object& points,
             const FrameStatistics* statistics) {
            const SegmentationView masks = segmentation_view(segmentation);
            const Features features(points, py::none(), "InputChecks");
            self.add(frame, masks, features.view(), statistics);
          },
          py::arg("frame"), py::arg("segmentation") = py::none(), py::arg("points") = py::none(),
          py::arg("statistics") = py::none(),
          R"(Adds a frame, its masks (None: unknown), all its features as an (N, 2) array, and the
filter's statistics. Raises ValueError for malformed input.)")
      .def("findings", &InputChecks::findings, "Returns what is wrong so far, as InputFindings.")
      .def("__len__", &InputChecks::frames);
}

}  // namespace dynfilter::python
