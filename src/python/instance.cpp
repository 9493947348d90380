// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/instance.hpp"

#include <optional>

#include "arrays.hpp"
#include "bindings.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

Instance make_instance(int class_id, float score, const cv::Rect& box, const cv::Point& mask_origin,
                       const py::object& mask, std::optional<int> track_id,
                       const cv::Size& image_size) {
  const cv::Mat pixels = matrix_from(mask, Pixels::mask, {"Instance", "a mask"});
  return {class_id, score, box, mask_origin, pixels, track_id, image_size};
}

Instance from_image_mask(const py::object& mask, const std::optional<cv::Rect>& box, int class_id,
                         float score) {
  const cv::Mat pixels = matrix_from(mask, Pixels::mask, {"Instance::from_image_mask", "a mask"});
  return box ? Instance::from_image_mask(pixels, *box, class_id, score)
             : Instance::from_image_mask(pixels, class_id, score);
}

void add_converters(py::class_<Instance>& instance) {
  instance
      .def_static("from_image_mask", &from_image_mask, py::arg("mask"), py::arg("box") = py::none(),
                  py::arg("class_id") = 0, py::arg("score") = 1.0F,
                  R"(Makes an instance from a mask of the whole image: non-zero = on the object.

The instance keeps the part that holds the object, without a copy. Without a box it gets the
smallest one around the mask's pixels.)")
      .def_static("from_box", &Instance::from_box, py::arg("box"), py::arg("class_id") = 0,
                  py::arg("score") = 1.0F,
                  "Makes an instance from a box alone, with an empty mask.");
}

}  // namespace

void bind_instance(py::module_& module) {
  py::class_<Instance> instance(
      module, "Instance",
      R"(One detected object of a frame. Its members cannot be changed; make another one.

Box and mask are placed independently of each other, because boxes get grown, predicted, clipped
or stale. Coordinates are pixels of the image that was segmented. See also Segmentation.from_masks.)");
  instance
      .def(py::init(&make_instance), py::kw_only(), py::arg("class_id") = 0,
           py::arg("score") = 1.0F, py::arg("box") = cv::Rect(),
           py::arg("mask_origin") = cv::Point(), py::arg("mask") = py::none(),
           py::arg("track_id") = py::none(), py::arg("image_size") = cv::Size(),
           R"(Takes the members as they are.

class_id: the network's class id; 0 is COCO's person where there is no id for background
score: the detector's confidence, 0 to 1
box: the detector's box (x, y, width, height), pixels; may reach beyond the image
mask_origin: position (x, y) of the mask's top-left pixel in the image
mask: bool or uint8, non-zero = on the object; None = only a box is known
track_id: identity across frames, if it is tracked
image_size: (width, height) of the image that the mask was cut from; (0, 0) = unknown)")
      .def_readonly("class_id", &Instance::class_id, "the network's class id")
      .def_readonly("score", &Instance::score, "the detector's confidence, 0 to 1")
      .def_readonly("box", &Instance::box, "the detector's box (x, y, width, height), pixels")
      .def_readonly("mask_origin", &Instance::mask_origin,
                    "position (x, y) of the mask's top-left pixel in the image")
      .def_property_readonly(
          "mask", [](const Instance& self) { return array_of(self.mask); },
          "bool or uint8, non-zero = on the object; None = only a box is known")
      .def_readonly("track_id", &Instance::track_id, "identity across frames, or None")
      .def_readonly("image_size", &Instance::image_size,
                    "(width, height) of the image that the mask was cut from, or (0, 0)");
  add_text(instance, {"class_id", "score", "box", "mask_origin", "track_id", "image_size"});
  add_converters(instance);

  module.def(
      "instances_from_binary_mask",
      [](const py::object& mask, int box_margin_px, int min_pixels) {
        return instances_from_binary_mask(
            matrix_from(mask, Pixels::mask, {"instances_from_binary_mask", "a mask"}),
            box_margin_px, min_pixels);
      },
      py::arg("mask"), py::arg("box_margin_px") = 0, py::arg("min_pixels") = 1,
      R"(Makes one instance for each connected object (8-neighbours) of a mask that does not
distinguish objects: the size of the image, non-zero = on some object.

The box is the smallest one, grown by box_margin_px on each side and clipped to the image, because
such masks come without the detector's box and edge features lie beyond the mask. Objects of fewer
than min_pixels pixels are left out as noise.)");
}

}  // namespace dynfilter::python
