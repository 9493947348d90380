// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmentation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "dynfilter/frame.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

constexpr const char* name = "Segmentation";

using Numbers = py::array_t<double, py::array::c_style>;

[[noreturn]] void refuse(const char* what, const py::array& array, const std::string& want) {
  detail::throw_misuse(name, detail::concatenate(what, " of ", description(array)), want);
}

/// Returns the smallest box of whole pixels that holds the box between two corners.
cv::Rect box_of(const double* corners) {
  constexpr double limit = 1e9;  // of coordinates, so that width and height fit into an int
  const bool is_box =
      std::all_of(corners, corners + 4, [](double x) { return std::abs(x) < limit; }) &&
      corners[0] <= corners[2] && corners[1] <= corners[3];
  if (!is_box) {
    detail::throw_misuse(name,
                         detail::concatenate("a box from (", corners[0], ", ", corners[1], ") to (",
                                             corners[2], ", ", corners[3], ")"),
                         "finite x1, y1, x2, y2 with x1 <= x2 and y1 <= y2");
  }
  const cv::Point first(cvFloor(corners[0]), cvFloor(corners[1]));
  return {first, cv::Point(cvCeil(corners[2]), cvCeil(corners[3]))};
}

int class_id_of(double number) {
  const bool is_id = number >= 0 && number <= 1e9 && number == std::floor(number);
  if (is_id) return static_cast<int>(number);
  detail::throw_misuse(name, detail::concatenate("a class id of ", number),
                       "whole numbers from 0 to 1000000000");
}

/// Warns of a mask that looks like probabilities times 255. Looks at every fourth row.
void warn_of_grey_levels(const cv::Mat& mask) {
  constexpr int max_levels = 8;
  std::array<bool, 256> seen{};
  int levels = 0;
  for (int y = 0; y < mask.rows; y += 4) {
    const std::uint8_t* const row = mask.ptr(y);
    for (int x = 0; x < mask.cols; ++x) {
      if (!std::exchange(seen[row[x]], true)) ++levels;
    }
  }
  constexpr const char* text =
      "a mask has many grey levels, and every one but 0 counts as on the object; threshold it "
      "first";
  if (levels > max_levels && PyErr_WarnEx(PyExc_UserWarning, text, 1) != 0) {
    throw py::error_already_set();
  }
}

/// Whether an array is what NumPy makes of an empty list.
bool is_empty_list(const py::array& array) { return array.ndim() == 1 && array.size() == 0; }

/// Returns masks as N x H x W of bool or uint8, floats where they exceed the threshold. torchvision
/// has N x 1 x H x W, and a list of no mask has no size.
py::array stacked(const py::object& masks, double threshold) {
  py::array array = array_from(masks);
  if (is_empty_list(array)) return py::array(py::dtype::of<bool>(), {0, 0, 0});
  if (array.ndim() == 4 && array.shape(1) == 1) {
    array = array.attr("__getitem__")(py::make_tuple(py::slice(0, array.shape(0), 1), 0));
  }
  const char kind = array.dtype().kind();
  const bool is_byte = kind == 'b' || (kind == 'u' && array.itemsize() == 1);
  if (array.ndim() != 3 || (!is_byte && kind != 'f')) {
    refuse("masks", array, "bool, uint8 or float, N x H x W or N x 1 x H x W");
  }
  return is_byte ? array : array.attr("__gt__")(threshold);
}

/// Returns N numbers, or nothing for None.
std::vector<double> column(const py::object& object, const char* what, py::ssize_t count) {
  if (object.is_none()) return {};
  const Numbers numbers = numbers_from(object, {name, what});
  if (numbers.ndim() != 1 || numbers.size() != count) {
    refuse(what, numbers, detail::concatenate("one for each instance, ", count));
  }
  return {numbers.data(), numbers.data() + numbers.size()};
}

/// Returns N boxes, x1, y1, x2, y2 each.
Numbers corners_of(const py::object& boxes) {
  const Numbers corners = numbers_from(boxes, {name, "boxes"});
  if (is_empty_list(corners)) return Numbers(py::array::ShapeContainer{0, 4});
  if (corners.ndim() != 2 || corners.shape(1) != 4) {
    refuse("boxes", corners, "N x 4: x1, y1, x2, y2 in pixels");
  }
  return corners;
}

/// Checks that masks have the frame's size, which they give if the frame has no image: a network's
/// own masks often have the size of its input.
void require_size(const py::array& stack, cv::Size& image_size) {
  const cv::Size size(static_cast<int>(stack.shape(2)), static_cast<int>(stack.shape(1)));
  if (image_size.empty()) image_size = size;
  if (stack.shape(0) == 0 || size == image_size) return;
  detail::throw_misuse(name, "masks of " + detail::size_name(size),
                       detail::concatenate("the frame's size, ", detail::size_name(image_size),
                                           " (Ultralytics: retina_masks=True)"));
}

Segmentation from_masks(const FrameView& frame, const py::object& masks, const py::object& boxes,
                        const py::object& class_ids, const py::object& scores, double threshold) {
  if (masks.is_none() && boxes.is_none()) {
    detail::throw_misuse(name, "neither masks nor boxes",
                         "masks, N x H x W, or boxes, N x 4; for nobody an array with N = 0");
  }
  const cv::Size size = frame.image.empty() ? frame.depth.size() : frame.image.size();
  Segmentation segmentation{frame.id, frame.timestamp_s, size, {}};
  std::optional<py::array> stack;
  if (!masks.is_none()) {
    stack = stacked(masks, threshold);
    require_size(*stack, segmentation.image_size);
  }
  std::optional<Numbers> corners;
  if (!boxes.is_none()) corners = corners_of(boxes);
  const py::ssize_t count = stack ? stack->shape(0) : corners->shape(0);
  if (corners && corners->shape(0) != count) {
    refuse("boxes", *corners, detail::concatenate("one for each mask, ", count));
  }
  const std::vector<double> classes = column(class_ids, "class_ids", count);
  const std::vector<double> confidences = column(scores, "scores", count);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    const int class_id = classes.empty() ? 0 : class_id_of(classes[k]);
    const float score = confidences.empty() ? 1.0F : static_cast<float>(confidences[k]);
    Instance instance = Instance::from_box({}, class_id, score);
    if (stack) {
      const py::array array = stack->attr("__getitem__")(k);
      const cv::Mat mask = matrix_from(array, Pixels::mask, {name, "a mask"});
      if (array.dtype().kind() == 'u') warn_of_grey_levels(mask);
      instance = Instance::from_image_mask(mask, class_id, score);
    }
    if (corners) instance.box = box_of(corners->data(static_cast<py::ssize_t>(k), 0));
    segmentation.instances.push_back(std::move(instance));
  }
  validate(segmentation, name);
  return segmentation;
}

Segmentation make_segmentation(std::uint64_t frame_id, std::optional<double> timestamp_s,
                               const cv::Size& image_size, std::vector<Instance> instances) {
  Segmentation result{frame_id, timestamp_s, image_size, std::move(instances)};
  validate(result, name);
  return result;
}

constexpr const char* from_masks_doc =
    R"(Makes the segmentation of a frame from the arrays of a network, as torchvision and
Ultralytics return them. Number, time and size are the frame's.

masks: N x H x W or N x 1 x H x W of the whole image; bool and uint8 (non-zero = on the
    object) are not copied, float is on the object above the threshold; None if only boxes are
    known. A uint8 mask with many grey levels is a UserWarning.
boxes: N x 4, x1, y1, x2, y2 in pixels, float or int; None = the smallest around the masks
class_ids: N whole numbers; None = 0. torchvision's person is 1: DynamicFilter(dynamic_classes=[1])
scores: N numbers from 0 to 1; None = 1
threshold: of float masks)";

}  // namespace

void bind_segmentation(py::module_& module) {
  const auto none = py::none();
  py::class_<Segmentation> segmentation(
      module, "Segmentation",
      R"(Result of a segmenter for one image. Its members cannot be changed; make another one.

A segmentation without instances says that nobody is there; None in its place says that no masks
are known. The statistics distinguish the two.)");
  segmentation
      .def(py::init(&make_segmentation), py::kw_only(), py::arg("frame_id") = 0,
           py::arg("timestamp_s") = none, py::arg("image_size") = cv::Size(),
           py::arg("instances") = std::vector<Instance>(),
           R"(Takes number and time of the image that was segmented, its size (width, height), and
the instances. Raises ValueError for a malformed one.)")
      .def_static("from_masks", &from_masks, py::arg("frame"), py::arg("masks"),
                  py::arg("boxes") = none, py::arg("class_ids") = none, py::arg("scores") = none,
                  py::arg("threshold") = 0.5, from_masks_doc)
      .def_readonly("frame_id", &Segmentation::frame_id,
                    "FrameView.id of the image that was segmented")
      .def_readonly("timestamp_s", &Segmentation::timestamp_s,
                    "time of that image, seconds; earlier than the frame's when masks are stale; "
                    "None = not known: the masks count as fresh")
      .def_readonly("image_size", &Segmentation::image_size, "(width, height), pixels")
      .def_property_readonly(
          "instances", [](const Segmentation& self) { return py::tuple(py::cast(self.instances)); },
          "the detected objects, in the segmenter's order");
  add_text(segmentation, {"frame_id", "timestamp_s", "image_size"});
}

}  // namespace dynfilter::python
