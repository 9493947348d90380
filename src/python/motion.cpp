// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "dynfilter/motion/motion_filter.hpp"
#include "filter_arguments.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// MotionState for one thread at a time: others wait.
struct LockedState : std::enable_shared_from_this<LockedState> {
  std::mutex mutex;
  MotionState state;
};

/// MotionFilter with its state, which it keeps alive, and a workspace.
class StatefulFilter {
 public:
  StatefulFilter(const PinholeCamera& camera, std::shared_ptr<LockedState> state,
                 const DynamicFilterOptions& options)
      : state_(std::move(state)),
        filter_(camera, state_->state, {options, {}}),
        options_(options) {}

  const DynamicFilterOptions& options() const { return options_; }

  FeatureLabels apply(const FrameView& frame, const py::object& masks, const py::object& points,
                      const py::object& depths_m) {
    const SegmentationView segmentation = segmentation_of(masks, "MotionFilter");
    const Features features(points, depths_m, "MotionFilter");
    FeatureLabels labels;
    const py::gil_scoped_release unlock;
    const std::lock_guard<std::mutex> lock(state_->mutex);
    filter_.apply(frame, segmentation, features.view(), labels, workspace_);
    return labels;
  }

  OptionalArray track(const FrameView& frame, const py::object& points) {
    const Features features(points, py::none(), "MotionFilter");
    std::vector<FeatureTrack> tracks;
    bool is_known = false;
    {
      const py::gil_scoped_release unlock;
      const std::lock_guard<std::mutex> lock(state_->mutex);
      is_known = filter_.stage<MotionJudge>().track(frame, features.view(), tracks, workspace_);
    }
    if (!is_known) return OptionalArray(py::none());
    py::array_t<float> places({static_cast<py::ssize_t>(tracks.size()), py::ssize_t{2}});
    auto write = places.mutable_unchecked<2>();
    constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const auto row = static_cast<py::ssize_t>(i);
      write(row, 0) = tracks[i].is_found ? tracks[i].position.x : nowhere;
      write(row, 1) = tracks[i].is_found ? tracks[i].position.y : nowhere;
    }
    return OptionalArray(places);
  }

 private:
  std::shared_ptr<LockedState> state_;
  MotionFilter filter_;
  DynamicFilterOptions options_;
  Workspace workspace_;
};

}  // namespace

void bind_motion(py::module_& module) {
  ValueClass<PinholeCamera>(
      module, "PinholeCamera",
      "Pinhole camera with OpenCV's radial-tangential distortion, for components\n"
      "that relate pixels to rays.")
      .field("fx", &PinholeCamera::fx, "focal length in x, pixels")
      .field("fy", &PinholeCamera::fy, "focal length in y, pixels")
      .field("cx", &PinholeCamera::cx, "principal point's x, pixels")
      .field("cy", &PinholeCamera::cy, "principal point's y, pixels")
      .field("k1", &PinholeCamera::k1, "distortion coefficient")
      .field("k2", &PinholeCamera::k2, "distortion coefficient")
      .field("p1", &PinholeCamera::p1, "distortion coefficient")
      .field("p2", &PinholeCamera::p2, "distortion coefficient")
      .field("k3", &PinholeCamera::k3, "distortion coefficient")
      .bound()
      .def(py::init([](double fx, double fy, double cx, double cy, double k1, double k2, double p1,
                       double p2, double k3) {
             const PinholeCamera camera{fx, fy, cx, cy, k1, k2, p1, p2, k3};
             validate(camera, "PinholeCamera");
             return camera;
           }),
           py::kw_only(), py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"),
           py::arg("k1") = 0.0, py::arg("k2") = 0.0, py::arg("p1") = 0.0, py::arg("p2") = 0.0,
           py::arg("k3") = 0.0,
           R"(fx, fy: focal lengths, pixels; above 0
cx, cy: principal point, pixels
k1, k2, p1, p2, k3: distortion; all 0 = rectified images)");

  py::class_<LockedState, std::shared_ptr<LockedState>>(
      module, "MotionState",
      R"(Memory of MotionJudge: what it knows of one camera's earlier frames. MotionFilter has
this stage. One state for each camera and each filter; two states share nothing.)")
      .def(py::init<>(), "Makes a state that knows nothing.")
      .def(
          "reset",
          [](LockedState& self) {
            const py::gil_scoped_release unlock;
            const std::lock_guard<std::mutex> lock(self.mutex);
            self.state.reset();
          },
          "Forgets everything, like a new state.")
      .def("__repr__", [](const py::object& self) {
        self.cast<const LockedState&>();
        return type_name(self) + "()";
      });

  py::class_<StatefulFilter>(
      module, "MotionFilter",
      R"(DynamicFilter with motion evidence: masks and depth say what may be dynamic, motion says
what is.

    memory = dynfilter.MotionState()  # one for each camera
    filter = dynfilter.MotionFilter(camera, memory)
    labels = filter.apply(frame, masks, points)  # every frame, in order

Frames need an image and depth. Threads that use one filter wait for each other.)")
      .def(py::init([](const PinholeCamera& camera, LockedState& state,
                       std::vector<int> dynamic_classes, double margin_px,
                       const py::object& static_mask, CompensationRule rule,
                       const DepthCompensatorOptions& depth, const EdgeCompensatorOptions& paper,
                       std::size_t floor) {
             return std::make_unique<StatefulFilter>(
                 camera, state.shared_from_this(),
                 filter_options(std::move(dynamic_classes), margin_px, static_mask, rule, depth,
                                paper, floor));
           }),
           py::arg("camera"), py::arg("state").none(false), py::kw_only(),
           py::arg("dynamic_classes") = std::vector<int>{0}, py::arg("margin_px") = 0.0,
           py::arg("static_mask") = py::none(),
           py::arg_v("rule", CompensationRule::depth, "CompensationRule.depth"),
           py::arg_v("depth", DepthCompensatorOptions(), "DepthCompensatorOptions()"),
           py::arg_v("paper", EdgeCompensatorOptions(), "EdgeCompensatorOptions()"),
           py::arg("floor") = 0, filter_options_doc)
      .def("apply", &StatefulFilter::apply, py::arg("frame"), py::arg("segmentation"),
           py::arg("features"), py::arg("depths_m") = py::none(), apply_doc)
      .def("track", &StatefulFilter::track, py::arg("frame"), py::arg("features"),
           R"(Returns where the features were in the last frame: N x 2, float32, NaN for those not
found. Returns None if the last frame is not known. Serves what needs tracks before this frame's
masks are known:

    tracks = filter.track(frame, points)
    masks = propagator.propagate(frame, newest, points, tracks)
    labels = filter.apply(frame, masks, points)

apply must be the next call, with the same frame and features. It takes these tracks, and gives the
same labels as without.)")
      .def("__repr__", [](const py::object& self) {
        return text_of(self, self.cast<const StatefulFilter&>().options());
      });
}

}  // namespace dynfilter::python
