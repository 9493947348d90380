// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/frame.hpp"

#include <cstdint>

#include "arrays.hpp"
#include "bindings.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// Makes a frame of arrays. Throws std::invalid_argument for malformed ones.
FrameView make_frame(std::uint64_t id, double timestamp_s, const py::object& image,
                     const py::object& depth, double metres_per_unit) {
  FrameView frame;
  frame.id = id;
  frame.timestamp_s = timestamp_s;
  frame.image = matrix_from(image, Pixels::image, {"FrameView", "an image"});
  frame.depth = matrix_from(depth, Pixels::depth, {"FrameView", "a depth image"});
  frame.metres_per_unit = metres_per_unit;
  validate(frame, "FrameView");
  return frame;
}

}  // namespace

void bind_frame(py::module_& module) {
  py::class_<FrameView> view(module, "FrameView", R"(One frame: pixels, time and number.

It refers to your arrays: nothing is copied, and it keeps them alive. The library only reads them.
Every member may be None; a component that needs one says so in an error or in the statistics.

    frame = dynfilter.FrameView(image=image, depth=depth, metres_per_unit=1 / 5000)
)");
  view.def(py::init(&make_frame), py::kw_only(), py::arg("id") = 0, py::arg("timestamp_s") = 0.0,
           py::arg("image") = py::none(), py::arg("depth") = py::none(),
           py::arg("metres_per_unit") = 0.0,
           R"(Checks and keeps the arrays.

image: uint8, H x W (grey), or H x W x 3 or 4 (blue, green, red, alpha), or None
depth: registered to the image: uint16 with metres_per_unit, or float32; H x W, or None
metres_per_unit: metres per unit of depth; float32 is in metres when it is 0

Raises ValueError for another type, size or layout. Rows may have any distance; the pixels of a
row must be neighbours.)")
      .def_readonly("id", &FrameView::id,
                    "the host's frame number; it seeds the frame's random sample")
      .def_readonly("timestamp_s", &FrameView::timestamp_s, "time of the frame, seconds")
      .def_property_readonly(
          "image", [](const FrameView& frame) { return array_of(frame.image); },
          "8-bit, grey or BGR, or None")
      .def_property_readonly(
          "depth", [](const FrameView& frame) { return array_of(frame.depth); },
          "registered to the image, uint16 or float32, or None")
      .def_readonly("metres_per_unit", &FrameView::metres_per_unit, "metres per unit of depth");
  add_text(view, {"id", "timestamp_s", "metres_per_unit"});
}

}  // namespace dynfilter::python
