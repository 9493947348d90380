// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <mutex>

#include "dynfilter/motion/motion_filter.hpp"
#include "filter_arguments.hpp"

namespace dynfilter::python {
namespace {

/// MotionFilter for one thread at a time: others wait.
class LockedFilter {
 public:
  LockedFilter(const Camera& camera, const DynamicFilterOptions& options)
      : filter_(camera, {options, {}}) {}

  FeatureLabels apply(const FrameView& frame, const SegmentationView& segmentation,
                      const FeaturesView& features) {
    const std::lock_guard<std::mutex> lock(mutex_);
    FeatureLabels labels;
    filter_.apply(frame, segmentation, features, labels, workspace_);
    return labels;
  }

  void reset() {
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
  add_filter_members<LockedFilter, const Camera&>(filter, "MotionFilter", py::arg("camera"));
  filter.def("reset", &LockedFilter::reset, py::call_guard<Unlocked>(),
             "Forgets everything, like a new filter.");
}

}  // namespace dynfilter::python
