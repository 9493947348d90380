// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/statistics.hpp"

#include "bindings.hpp"
#include "dynfilter/detail/errors.hpp"

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
             "applied by the features' own depths: the frame has no depth image");
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
  py::class_<ValueRange>(module, "ValueRange", "Closed interval [lower, upper] of values.")
      .def_readonly("lower", &ValueRange::lower, "smallest value; infinity if empty")
      .def_readonly("upper", &ValueRange::upper, "largest value; -infinity if empty")
      .def_property_readonly("empty", &ValueRange::empty, "whether no value lies in the interval")
      .def("contains", &ValueRange::contains, py::arg("value"),
           "Whether a value lies in the interval.")
      .def("__repr__", [](const ValueRange& range) {
        return detail::concatenate("ValueRange(", range.lower, ", ", range.upper, ")");
      });
  using S = InstanceStatistics;
  py::class_<S>(module, "InstanceStatistics",
                "Statistics of one instance. Counts are numbers of features.")
      .def_readonly("class_id", &S::class_id, "class of the instance")
      .def_readonly("dynamic", &S::dynamic, "its class is one of the dynamic ones")
      .def_readonly("masked", &S::masked, "removed because they lie on the mask")
      .def_readonly("on_mask", &S::on_mask, "the part of `masked` that needed no margin")
      .def_readonly("sampled", &S::sampled,
                    "features or pixels that the ranges were estimated from")
      .def_readonly("candidates", &S::candidates,
                    "features in the box that no earlier stage or instance removed")
      .def_readonly("passed_depth", &S::passed_depth,
                    "candidates that the depth range alone would remove")
      .def_readonly("passed_code", &S::passed_code,
                    "candidates that the D-LBP range alone would remove")
      .def_readonly("passed_nearness", &S::passed_nearness,
                    "candidates without the object's depth, but surrounded by it")
      .def_readonly("compensated", &S::compensated, "removed by edge compensation")
      .def_readonly("compensation", &S::compensation, "outcome of edge compensation")
      .def_readonly("depth_range_m", &S::depth_range_m, "range of the object's depth, metres")
      .def_readonly("mask_gap_px", &S::mask_gap_px,
                    "gap between the mask and the object's edge, pixels; 0 where it is not known")
      .def_readonly("verdict", &S::verdict, "whether it moves")
      .def_readonly("given_back", &S::given_back, "features given back because it is still")
      .def_readonly("code_range", &S::code_range, "range of D-LBP codes; may be empty");
}

}  // namespace

void bind_statistics(py::module_& module) {
  bind_outcomes(module);
  bind_instance_statistics(module);
  using Motion = MotionStatistics;
  py::class_<Motion>(module, "MotionStatistics", "Statistics of the motion evidence in one frame.")
      .def_readonly("outcome", &Motion::outcome, "what happened")
      .def_readonly("tracked", &Motion::tracked, "features that were found in an earlier frame")
      .def_readonly("seeds", &Motion::seeds, "features whose track alone says that they move")
      .def_readonly("supported", &Motion::supported, "seeds beside which others move alike")
      .def_readonly("given_back", &Motion::given_back, "features given back because they are still")
      .def_readonly("scale_px", &Motion::scale_px,
                    "scale of the static features' residuals, one frame back, pixels")
      .def_readonly("support", &Motion::support,
                    "share of the features that agree with the camera's motion");
  using Frame = FrameStatistics;
  py::class_<Frame>(module, "FrameStatistics",
                    "Statistics of one frame. masked, compensated, moving, custom and kept add up\n"
                    "to features.")
      .def_readonly("features", &Frame::features, "features of the frame")
      .def_readonly("masked", &Frame::masked, "removed on a mask or on the static mask")
      .def_readonly("compensated", &Frame::compensated, "removed by edge compensation")
      .def_readonly("moving", &Frame::moving, "removed because they move")
      .def_readonly("custom", &Frame::custom, "removed by you")
      .def_readonly("restored", &Frame::restored,
                    "kept features that were removed first and given back")
      .def_readonly("starved", &Frame::starved,
                    "fewer features than the floor were left before restoring")
      .def_readonly("suggested_features", &Frame::suggested_features,
                    "number to extract next time; 0 = the present number suffices")
      .def_readonly("has_segmentation", &Frame::has_segmentation,
                    "False: no masks are known; True without instances: nobody is there")
      .def_readonly("segmentation_age_s", &Frame::segmentation_age_s,
                    "time of the frame minus time of its masks, seconds")
      .def_readonly("has_depth", &Frame::has_depth, "whether the frame has a depth image")
      .def_readonly("motion", &Frame::motion, "of the motion evidence")
      .def_property_readonly(
          "instances", [](const Frame& self) { return py::tuple(py::cast(self.instances)); },
          "one InstanceStatistics per instance, in the segmentation's order")
      .def_property_readonly("removed", &Frame::removed, "number of features that are removed")
      .def_property_readonly("kept", &Frame::kept, "number of features that are kept")
      .def("__repr__", [](const Frame& self) {
        return detail::concatenate("FrameStatistics(features=", self.features,
                                   ", masked=", self.masked, ", compensated=", self.compensated,
                                   ", moving=", self.moving, ", custom=", self.custom,
                                   ", kept=", self.kept(), ")");
      });
}

}  // namespace dynfilter::python
