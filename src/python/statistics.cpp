// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/statistics.hpp"

#include "values.hpp"

namespace dynfilter::python {
namespace {

void bind_outcomes(py::module_& module) {
  py::enum_<Compensation>(module, "Compensation", "Outcome of edge compensation for one instance.")
      .value("not_run", Compensation::not_run,
             "no compensation, or a class that is not dynamic and has no masked feature")
      .value("no_depth_image", Compensation::no_depth_image, "abstained: the frame has no depth")
      .value("too_few_samples", Compensation::too_few_samples,
             "abstained: too few features or pixels have depth to estimate the ranges")
      .value("applied", Compensation::applied, "the ranges were estimated and applied")
      .value("applied_without_image", Compensation::applied_without_image,
             "applied by the features' own depths: the frame has no depth image")
      .value("cautious", Compensation::cautious,
             "applied, but the least certain stay: too few would have been left to track")
      .value("no_mask_stage", Compensation::no_mask_stage,
             "abstained: features lie on the mask, but no earlier stage looked at the masks");
  py::enum_<InstanceVerdict>(module, "InstanceVerdict", "Verdict on the motion of an instance.")
      .value("not_judged", InstanceVerdict::not_judged, "no motion evidence, or it abstained")
      .value("undecided", InstanceVerdict::undecided,
             "too few tracks, or not still for long enough")
      .value("moving", InstanceVerdict::moving, "it moves in this frame")
      .value("still", InstanceVerdict::still, "it has been still for some frames");
  py::enum_<MotionOutcome>(module, "MotionOutcome", "Outcome of the motion evidence for one frame.")
      .value("not_run", MotionOutcome::not_run, "no motion evidence in the filter")
      .value("no_image", MotionOutcome::no_image, "abstained: the frame has no image")
      .value("started", MotionOutcome::started,
             "abstained: the first frame, or after a cut, a gap, or a time that did not grow")
      .value("repeated", MotionOutcome::repeated,
             "abstained: the image is that of the frame before")
      .value("too_few_tracks", MotionOutcome::too_few_tracks,
             "abstained: too few static features with depth could be tracked")
      .value("pose_not_trusted", MotionOutcome::pose_not_trusted,
             "abstained: the tracks agree on no motion of the camera")
      .value("applied", MotionOutcome::applied,
             "the motion of the camera is known, and features were judged by it");
}

void bind_instance_statistics(py::module_& module) {
  py::class_<ValueRange> range(module, "ValueRange", "Closed interval [lower, upper] of values.");
  add_text(range, {"lower", "upper"});
  range.def_readonly("lower", &ValueRange::lower, "smallest value; infinity if empty")
      .def_readonly("upper", &ValueRange::upper, "largest value; -infinity if empty")
      .def_property_readonly("empty", &ValueRange::empty, "whether no value lies in the interval")
      .def("contains", &ValueRange::contains, py::arg("value"),
           "Whether a value lies in the interval.");
  using S = InstanceStatistics;
  py::class_<S> statistics(module, "InstanceStatistics",
                           "Statistics of one instance. Counts are numbers of features.");
  add_text(statistics,
           {"class_id", "score", "dynamic", "masked", "compensated", "compensation", "verdict"});
  statistics.def_readonly("class_id", &S::class_id, "class of the instance")
      .def_readonly("score", &S::score, "the detector's confidence in the instance")
      .def_readonly("dynamic", &S::dynamic, "its class is one of the dynamic ones")
      .def_readonly("masked", &S::masked, "removed because they lie on the mask")
      .def_readonly("compensated", &S::compensated, "removed by edge compensation")
      .def_readonly("compensation", &S::compensation, "outcome of edge compensation")
      .def_readonly("depth_range_m", &S::depth_range_m, "range of the object's depth, metres")
      .def_readonly(
          "mask_gap_px", &S::mask_gap_px,
          "how far the object reaches beyond a fresh mask, pixels; 0 where it is not known")
      .def_readonly("verdict", &S::verdict, "whether it moves")
      .def_readonly("kept_still", &S::kept_still, "features kept because it is still");
}

}  // namespace

void bind_statistics(py::module_& module) {
  bind_outcomes(module);
  bind_instance_statistics(module);
  using Motion = MotionStatistics;
  py::class_<Motion> motion(module, "MotionStatistics",
                            "Statistics of the motion evidence in one frame.");
  add_text(motion, {"outcome", "tracked", "kept_still", "unsettled_objects"});
  motion.def_readonly("outcome", &Motion::outcome, "what happened")
      .def_readonly("tracked", &Motion::tracked, "features that were found in the last frame")
      .def_readonly("kept_still", &Motion::kept_still, "features kept because they are still")
      .def_readonly("unsettled_objects", &Motion::unsettled_objects,
                    "dynamic objects that matter and of which it is not known whether they move");
  using Frame = FrameStatistics;
  py::class_<Frame> frame(
      module, "FrameStatistics",
      "Statistics of one frame. masked, compensated, moving, custom and kept add\n"
      "up to features.");
  add_text(frame, {"features", "masked", "compensated", "moving", "custom", "kept"});
  frame.def_readonly("features", &Frame::features, "features of the frame")
      .def_readonly("masked", &Frame::masked, "removed on a mask or on the static mask")
      .def_readonly("compensated", &Frame::compensated, "removed by edge compensation")
      .def_readonly("moving", &Frame::moving, "removed because they move")
      .def_readonly("custom", &Frame::custom, "removed by you")
      .def_readonly("restored", &Frame::restored, "kept features that an earlier stage had removed")
      .def_readonly("starved", &Frame::starved, "fewer features than the floor are left")
      .def_readonly("suggested_features", &Frame::suggested_features,
                    "number to extract next time; 0 = the present number suffices")
      .def_readonly("has_segmentation", &Frame::has_segmentation,
                    "False: no masks are known; True without instances: nobody is there")
      .def_readonly(
          "segmentation_age_s", &Frame::segmentation_age_s,
          "time of the frame minus time of its masks, seconds; nan without masks or their time")
      .def_readonly("has_depth", &Frame::has_depth, "whether the frame has a depth image")
      .def_readonly("motion", &Frame::motion, "of the motion evidence")
      .def_property_readonly(
          "instances", [](const Frame& self) { return py::tuple(py::cast(self.instances)); },
          "one InstanceStatistics per instance, in the segmentation's order")
      .def_property_readonly("removed", &Frame::removed, "number of features that are removed")
      .def_property_readonly("kept", &Frame::kept, "number of features that are kept")
      .def_property_readonly(
          "is_motion_decided", &Frame::is_motion_decided,
          "whether motion is known of each object that matters: begin a map now");
}

}  // namespace dynfilter::python
