// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/host_masks.hpp"

#include <utility>
#include <vector>

#include "dynfilter/mask_refiner.hpp"
#include "filter_arguments.hpp"

namespace dynfilter::python {
namespace {

/// Calls `make` without the interpreter's lock and returns its matrix as an array.
template <class Make>
py::array made(const Make& make) {
  cv::Mat result;
  {
    const Unlocked unlock;
    result = make();
  }
  return array_of(result, true).value();
}

template <cv::Mat (*paint)(const Segmentation&, const MaskCuller&)>
py::array mask_of(const Segmentation& segmentation, std::vector<int> dynamic_classes,
                  double margin_px, const py::object& static_mask) {
  const MaskCuller culler(culler_options(std::move(dynamic_classes), margin_px, static_mask));
  return made([&] { return paint(segmentation, culler); });
}

py::array holes(const py::object& depth, const Segmentation& segmentation,
                std::vector<int> dynamic_classes, double margin_px, const py::object& static_mask) {
  const cv::Mat pixels = matrix_from(depth, Pixels::depth, {"depth_with_holes", "a depth image"});
  const MaskCuller culler(culler_options(std::move(dynamic_classes), margin_px, static_mask));
  return made([&] { return depth_with_holes(pixels, segmentation, culler); });
}

}  // namespace

void bind_host_masks(py::module_& module) {
  const auto classes = py::arg("dynamic_classes") = std::vector<int>{0};
  const auto margin = py::arg("margin_px") = 0.0;
  const auto own = py::arg("static_mask") = py::none();
  module.def(
      "mask_of_static_pixels", &mask_of<&mask_of_static_pixels>, py::arg("segmentation"),
      py::kw_only(), classes, margin, own,
      R"(Returns a mask of where to look, uint8 of the segmented image's size: 255 on the static
pixels, 0 on those on a dynamic object. The options are DynamicFilter's.

Raises ValueError for a malformed segmentation and for one without image_size.)");
  module.def(
      "mask_of_dynamic_pixels", &mask_of<&mask_of_dynamic_pixels>, py::arg("segmentation"),
      py::kw_only(), classes, margin, own,
      R"(Returns a mask of what to ignore: 255 on the dynamic pixels, else 0, as PyCuVSLAM has it.
Otherwise like mask_of_static_pixels.)");
  module.def("depth_with_holes", &holes, py::arg("depth"), py::arg("segmentation"), py::kw_only(),
             classes, margin, own,
             R"(Returns a copy of a depth image with 0, no depth, on the dynamic pixels.

depth: H x W, uint16 or float32 in any unit, registered to the segmented image; not changed

Raises ValueError for another type, a malformed segmentation and sizes that differ.)");
  module.def(
      "refined",
      [](const FrameView& frame, const Segmentation& segmentation, std::vector<int> dynamic_classes,
         double half_width_m) {
        const MaskCuller culler(culler_options(std::move(dynamic_classes), 0, py::none()));
        DepthCompensatorOptions options;
        options.half_width_m = half_width_m;
        const Unlocked unlock;
        return refined(frame, segmentation, culler, options);
      },
      py::arg("frame"), py::arg("segmentation"), py::kw_only(), classes,
      py::arg("half_width_m") = DepthCompensatorOptions().half_width_m,
      R"(Returns the segmentation with the masks of dynamic objects corrected by the frame's depth,
pixel by pixel, as CompensationRule.depth judges features. Without depth, masks stay. The options are
DynamicFilter's.

Raises ValueError for a malformed frame or segmentation.)");
}

}  // namespace dynfilter::python
