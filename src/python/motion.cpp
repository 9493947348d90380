// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/motion/motion_filter.hpp"
#include "filter_arguments.hpp"
#include "unlocked.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// MotionFilter for one thread at a time: others wait.
class LockedFilter {
 public:
  LockedFilter(const PinholeCamera& camera, const DynamicFilterOptions& options)
      : filter_(camera, {options, {}}) {}

  FeatureLabels apply(const FrameView& frame, const py::object& masks, const py::object& points,
                      const py::object& depths_m) {
    const SegmentationView segmentation = segmentation_of(masks, "MotionFilter");
    const Features features(points, depths_m, "MotionFilter");
    FeatureLabels labels;
    const Unlocked unlock;
    const std::lock_guard<std::mutex> lock(mutex_);
    filter_.apply(frame, segmentation, features.view(), labels, workspace_);
    return labels;
  }

  void reset() {
    const Unlocked unlock;
    const std::lock_guard<std::mutex> lock(mutex_);
    filter_.judge().reset();
  }

 private:
  std::mutex mutex_;
  MotionFilter filter_;
  Workspace workspace_;
};

}  // namespace

void bind_motion(py::module_& module) {
  ValueClass<PinholeCamera> pinhole(
      module, "PinholeCamera",
      "Pinhole camera with OpenCV's radial-tangential distortion, for components\n"
      "that relate pixels to rays.");
  add_camera_fields(pinhole);
  pinhole.bound()
      .def(py::init([](double fx, double fy, double cx, double cy, double k1, double k2, double p1,
                       double p2, double k3) {
             const PinholeCamera camera{fx, fy, cx, cy, k1, k2, p1, p2, k3};
             validate(camera, "PinholeCamera");
             return camera;
           }),
           py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"), py::arg("k1") = 0.0,
           py::arg("k2") = 0.0, py::arg("p1") = 0.0, py::arg("p2") = 0.0, py::arg("k3") = 0.0,
           R"(fx, fy: focal lengths, pixels; above 0
cx, cy: principal point, pixels
k1, k2, p1, p2, k3: distortion; all 0 = rectified images)")
      .def(py::init([](const CameraParameters& c) {
             return PinholeCamera{c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3};
           }),
           py::arg("camera"), "camera: of a sequence");
  py::implicitly_convertible<CameraParameters, PinholeCamera>();

  py::class_<LockedFilter> filter(
      module, "MotionFilter",
      R"(DynamicFilter with motion evidence: masks and depth say what may be dynamic, motion says
what is.

    filter = dynfilter.MotionFilter(camera)  # one for each camera
    labels = filter.apply(frame, masks, points)  # every frame, in order

It remembers earlier frames. Frames need an image, a time that grows, and depth. Threads that use
one filter wait for each other.)");
  add_filter_members<LockedFilter, const PinholeCamera&>(filter, py::arg("camera"));
  filter.def("reset", &LockedFilter::reset, "Forgets everything, like a new filter.");
}

}  // namespace dynfilter::python
