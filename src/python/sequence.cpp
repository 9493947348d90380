// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <filesystem>
#include <optional>

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

void bind_cameras(py::module_& module) {
  py::class_<Camera> camera(
      module, "Camera",
      "Pinhole camera with OpenCV's radial-tangential distortion, which relates pixels to rays.");
  add_text(camera, {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"});
  camera
      .def(py::init([](double fx, double fy, double cx, double cy, double k1, double k2, double p1,
                       double p2, double k3) {
             const Camera made{fx, fy, cx, cy, k1, k2, p1, p2, k3};
             validate(made, "Camera");
             return made;
           }),
           py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"), py::arg("k1") = 0.0,
           py::arg("k2") = 0.0, py::arg("p1") = 0.0, py::arg("p2") = 0.0, py::arg("k3") = 0.0,
           R"(fx, fy: focal lengths, pixels; above 0
cx, cy: principal point, pixels
k1, k2, p1, p2, k3: distortion; all 0 = rectified images)")
      .def_readonly("fx", &Camera::fx, "focal length in x, pixels")
      .def_readonly("fy", &Camera::fy, "focal length in y, pixels")
      .def_readonly("cx", &Camera::cx, "principal point's x, pixels")
      .def_readonly("cy", &Camera::cy, "principal point's y, pixels")
      .def_readonly("k1", &Camera::k1, "distortion coefficient")
      .def_readonly("k2", &Camera::k2, "distortion coefficient")
      .def_readonly("p1", &Camera::p1, "distortion coefficient")
      .def_readonly("p2", &Camera::p2, "distortion coefficient")
      .def_readonly("k3", &Camera::k3, "distortion coefficient");
  py::class_<SequenceCamera, Camera>(
      module, "SequenceCamera",
      "Camera of a recorded sequence: the lens, and how images and depth were recorded.")
      .def_readonly("image_size", &SequenceCamera::image_size,
                    "(width, height), pixels; (0, 0) = unknown")
      .def_readonly("frames_per_second", &SequenceCamera::frames_per_second,
                    "frame rate, Hz; 0 = unknown")
      .def_readonly("depth_units_per_metre", &SequenceCamera::depth_units_per_metre,
                    "DepthMapFactor; 5000 for TUM and BONN")
      .def_readonly("depth_offset_s", &SequenceCamera::depth_offset_s, "see RgbdSequence");
}

}  // namespace

void bind_sequence(py::module_& module) {
  bind_cameras(module);
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
