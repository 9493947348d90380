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
             "applied, but the least certain stay: too few would have been left to track");
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
             "abstained: the first frame, or the first after a cut or a jump of time")
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
  ValueClass<ValueRange>(module, "ValueRange", "Closed interval [lower, upper] of values.")
      .field("lower", &ValueRange::lower, "smallest value; infinity if empty")
      .field("upper", &ValueRange::upper, "largest value; -infinity if empty")
      .bound()
      .def_property_readonly("empty", &ValueRange::empty, "whether no value lies in the interval")
      .def("contains", &ValueRange::contains, py::arg("value"),
           "Whether a value lies in the interval.");
  using S = InstanceStatistics;
  ValueClass<S>(module, "InstanceStatistics",
                "Statistics of one instance. Counts are numbers of features.")
      .field("class_id", &S::class_id, "class of the instance")
      .field("score", &S::score, "the detector's confidence in the instance")
      .field("dynamic", &S::dynamic, "its class is one of the dynamic ones")
      .field("masked", &S::masked, "removed because they lie on the mask")
      .field("compensated", &S::compensated, "removed by edge compensation")
      .field("compensation", &S::compensation, "outcome of edge compensation")
      .field("depth_range_m", &S::depth_range_m, "range of the object's depth, metres")
      .field("mask_gap_px", &S::mask_gap_px,
             "how far the object reaches beyond a fresh mask, pixels; 0 where it is not known")
      .field("verdict", &S::verdict, "whether it moves")
      .field("kept_still", &S::kept_still, "features kept because it is still")
      .prints({"class_id", "score", "dynamic", "masked", "compensated", "compensation", "verdict"});
}

}  // namespace

void bind_statistics(py::module_& module) {
  bind_outcomes(module);
  bind_instance_statistics(module);
  using Motion = MotionStatistics;
  ValueClass<Motion>(module, "MotionStatistics", "Statistics of the motion evidence in one frame.")
      .field("outcome", &Motion::outcome, "what happened")
      .field("tracked", &Motion::tracked, "features that were found in the last frame")
      .field("kept_still", &Motion::kept_still, "features kept because they are still")
      .field("unsettled_objects", &Motion::unsettled_objects,
             "dynamic objects that matter and of which it is not known whether they move");
  using Frame = FrameStatistics;
  ValueClass<Frame>(module, "FrameStatistics",
                    "Statistics of one frame. masked, compensated, moving, custom and kept add up\n"
                    "to features.")
      .field("features", &Frame::features, "features of the frame")
      .field("masked", &Frame::masked, "removed on a mask or on the static mask")
      .field("compensated", &Frame::compensated, "removed by edge compensation")
      .field("moving", &Frame::moving, "removed because they move")
      .field("custom", &Frame::custom, "removed by you")
      .field("restored", &Frame::restored, "kept features that an earlier stage had removed")
      .field("starved", &Frame::starved, "fewer features than the floor are left")
      .field("suggested_features", &Frame::suggested_features,
             "number to extract next time; 0 = the present number suffices")
      .field("has_segmentation", &Frame::has_segmentation,
             "False: no masks are known; True without instances: nobody is there")
      .field("segmentation_age_s", &Frame::segmentation_age_s,
             "time of the frame minus time of its masks, seconds; nan without masks or their time")
      .field("has_depth", &Frame::has_depth, "whether the frame has a depth image")
      .field("motion", &Frame::motion, "of the motion evidence")
      .field(
          "instances", &Frame::instances,
          [](const auto& instances) { return py::tuple(py::cast(instances)); },
          "one InstanceStatistics per instance, in the segmentation's order")
      .prints({"features", "masked", "compensated", "moving", "custom", "kept"})
      .bound()
      .def_property_readonly("removed", &Frame::removed, "number of features that are removed")
      .def_property_readonly("kept", &Frame::kept, "number of features that are kept")
      .def_property_readonly(
          "is_motion_decided", &Frame::is_motion_decided,
          "whether motion is known of each object that matters: begin a map now");
}

}  // namespace dynfilter::python
