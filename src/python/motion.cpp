// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "dynfilter/motion/motion_filter.hpp"
#include "filter_arguments.hpp"
#include "unlocked.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// MotionFilter for one thread at a time: others wait.
class LockedFilter {
 public:
  LockedFilter(const Camera& camera, const DynamicFilterOptions& options)
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
  py::class_<LockedFilter> filter(
      module, "MotionFilter",
      R"(DynamicFilter with motion evidence, for frames in order with depth and a camera: masks and
depth say what may be dynamic, motion says what is.

    filter = dynfilter.MotionFilter(camera)  # one for each camera
    labels = filter.apply(frame, masks, points)  # every frame, in order

It remembers earlier frames. Frames need an image, a time that grows, and depth. Threads that use
one filter wait for each other.)");
  add_filter_members<LockedFilter, const Camera&>(filter, py::arg("camera"));
  filter.def("reset", &LockedFilter::reset, "Forgets everything, like a new filter.");
}

}  // namespace dynfilter::python
