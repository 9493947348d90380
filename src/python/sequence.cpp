// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/frame.hpp"
#include "unlocked.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

FrameView frame_at(const RgbdSequence& sequence, py::ssize_t i) {
  const std::size_t index = index_of(i, sequence.size(), "frame");
  const Unlocked unlock;
  return sequence.read(index);
}

void bind_camera(py::module_& module) {
  using Camera = CameraParameters;
  ValueClass<Camera> camera(
      module, "CameraParameters",
      "Camera of a sequence: a pinhole camera with OpenCV's radial-tangential distortion.");
  add_camera_fields(camera);
  camera.field("image_size", &Camera::image_size, "(width, height), pixels; (0, 0) = unknown")
      .field("frames_per_second", &Camera::frames_per_second, "frame rate, Hz; 0 = unknown")
      .field("depth_units_per_metre", &Camera::depth_units_per_metre,
             "DepthMapFactor; 5000 for TUM and BONN")
      .field("depth_offset_s", &Camera::depth_offset_s, "see RgbdSequence");
}

}  // namespace

void bind_sequence(py::module_& module) {
  bind_camera(module);
  py::class_<RgbdSequence>(
      module, "RgbdSequence",
      R"(Recorded sequence in the layout of the TUM RGB-D benchmark and of BONN RGB-D Dynamic.

The frames are the rows of associations.txt if it exists. Otherwise the images of rgb.txt and
depth.txt are paired by time; without depth.txt the sequence has colour only. Frames are ordered
by time. A sequence can be indexed and iterated over; frames are decoded one at a time.

    for frame in dynfilter.RgbdSequence(folder): ...
)")
      .def(py::init([](const std::filesystem::path& folder, double max_time_difference_s,
                       const std::optional<std::filesystem::path>& camera_file,
                       std::optional<double> depth_offset_s) {
             RgbdSequenceOptions options;
             options.max_time_difference_s = max_time_difference_s;
             if (camera_file) options.camera_file = *camera_file;
             options.depth_offset_s = depth_offset_s;
             return RgbdSequence(folder, options);
           }),
           py::arg("folder"), py::kw_only(), py::arg("max_time_difference_s") = 0.02,
           py::arg("camera_file") = py::none(), py::arg("depth_offset_s") = py::none(),
           R"(Reads the lists and the camera file, and checks that the frames' images exist;
decodes none.

max_time_difference_s: largest difference in time between a colour image and its depth image
camera_file: None = camera.yaml in the sequence's folder
depth_offset_s: offset of the depth's stamps, seconds; positive: depth is late (TUM: about +0.033);
    None = the camera file's

Raises RuntimeError that names the file, and the line, for what is missing or malformed.)")
      .def("__len__", &RgbdSequence::size)
      .def("__getitem__", &frame_at, py::arg("frame"))
      .def("read", &frame_at, py::arg("frame"),
           R"(Decodes a frame: image uint8 H x W x 3 (blue, green, red), depth uint16 or float32 as
in the file. Several threads may call it at once. The interpreter's lock is released meanwhile.

Raises IndexError for a frame that does not exist, and RuntimeError that names a file that cannot be
read.)")
      .def_property_readonly("camera", &RgbdSequence::camera, "camera of the sequence")
      .def_property_readonly("folder", &RgbdSequence::folder, "folder of the sequence")
      .def_property_readonly("depth_offset_s", &RgbdSequence::depth_offset_s,
                             "offset that the frames were paired with, seconds")
      .def_property_readonly("has_depth", &RgbdSequence::has_depth,
                             "whether the frames have depth");
}

}  // namespace dynfilter::python
