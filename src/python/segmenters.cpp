// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_writer.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "unlocked.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// Segmenter whose do_segment is a method of a Python class.
class DerivedSegmenter final : public Segmenter {
 public:
  static Segmentation empty_segmentation_of(const FrameView& frame) {
    return empty_segmentation(frame);
  }

 private:
  Segmentation do_segment(const FrameView& frame) override {
    const py::gil_scoped_acquire lock;
    const py::function method = py::get_override(static_cast<const Segmenter*>(this), "do_segment");
    if (!method) {
      detail::throw_misuse("Segmenter", "a class without do_segment",
                           "a class derived from it with do_segment(self, frame)");
    }
    const py::object result = method(frame);  // a copy, which shares the pixels
    if (!py::isinstance<Segmentation>(result)) {
      detail::throw_misuse("Segmenter (result of do_segment)", "a " + type_name(result),
                           "a Segmentation");
    }
    return result.cast<Segmentation>();
  }
};

/// MaskPropagator for one thread at a time: others wait.
class LockedPropagator {
 public:
  explicit LockedPropagator(double max_age_s) : propagator_({max_age_s}) {}

  std::optional<Segmentation> propagate(const FrameView& frame,
                                        const std::optional<Segmentation>& newest) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return propagator_.propagate(frame, newest);
  }

  void reset() {
    const std::lock_guard<std::mutex> lock(mutex_);
    propagator_.reset();
  }

 private:
  std::mutex mutex_;
  MaskPropagator propagator_;
};

void bind_segmenter(py::module_& module) {
  py::class_<Segmenter, DerivedSegmenter>(
      module, "Segmenter",
      R"(Finds the objects in an image. Derived classes implement do_segment(self, frame);
callers use segment, which checks the result.

    class People(dynfilter.Segmenter):
        def do_segment(self, frame):
            masks, boxes = network(frame.image)
            return dynfilter.Segmentation.from_masks(frame, masks, boxes)
)")
      .def(py::init<>(), "For derived classes, which call it if they have an __init__.")
      .def("segment", &Segmenter::segment, py::arg("frame"), py::call_guard<Unlocked>(),
           R"(Segments the frame's image. Raises ValueError for a result that is malformed or
differs from the frame in image size, and passes on what do_segment raises.)")
      .def_static(
          "empty_segmentation", &DerivedSegmenter::empty_segmentation_of, py::arg("frame"),
          "Makes a segmentation of this frame without instances: id, time and size are filled in.");
}

void bind_mask_folder(py::module_& module) {
  py::class_<MaskFolderSegmenter, Segmenter>(
      module, "MaskFolderSegmenter",
      R"(Reads the instances of a frame from a folder of PNG files named by time,
1341846434.710184.png. A frame's mask is the nearest in time, within max_time_difference_s.

Label maps, if there is instances.csv (frame,instance,class_id,score,x,y,width,height): 8 or 16
bits, 0 = background, k = instance k of the frame. Binary masks, if there is no table: every
connected object is one instance of class 0 and score 1. The frame needs neither image nor depth.)")
      .def(py::init([](const std::filesystem::path& folder, double max_time_difference_s,
                       int box_margin_px, bool allow_missing) {
             return std::make_unique<MaskFolderSegmenter>(
                 folder, MaskFolderOptions{max_time_difference_s, box_margin_px, allow_missing});
           }),
           py::arg("folder"), py::kw_only(), py::arg("max_time_difference_s") = 0.001,
           py::arg("box_margin_px") = 20, py::arg("allow_missing") = false,
           R"(Reads the table and the names of the masks; decodes none.

max_time_difference_s: largest difference in time between a frame and its mask, seconds
box_margin_px: margin of the box around the object, pixels; binary masks only
allow_missing: whether masks may be missing; those of such a frame are unknown, see has_mask

Raises RuntimeError that names the file, and the line, for what is missing or malformed.)")
      .def("__len__", &MaskFolderSegmenter::size)
      .def("has_mask", &MaskFolderSegmenter::has_mask, py::arg("timestamp_s"),
           "Whether there is a mask for a frame of this time.")
      .def("values", &MaskFolderSegmenter::values,
           "Returns the different values but 0 of masks without a table, of 30 of them.");
}

void bind_mask_writer(py::module_& module) {
  py::class_<MaskFolderWriter>(
      module, "MaskFolderWriter",
      R"(Writes segmentations as label maps with an instances.csv: the first format that
MaskFolderSegmenter reads.

    with dynfilter.MaskFolderWriter("scene/masks") as writer:
        for frame in sequence:
            writer.add(people.segment(frame))

Where masks overlap, the instance with the lowest index gets the pixel. The masks appear in the
folder all together, with finish() or at the end of `with` unless an exception left it; until then
the folder keeps its contents.)")
      .def(py::init([](const std::filesystem::path& folder, bool overwrite) {
             return std::make_unique<MaskFolderWriter>(folder, MaskFolderWriterOptions{overwrite});
           }),
           py::arg("folder"), py::kw_only(), py::arg("overwrite") = false,
           R"(Makes the folder if needed.

overwrite: whether masks that an earlier MaskFolderWriter wrote may be replaced

Raises RuntimeError that names a file in the way.)")
      .def("__len__", &MaskFolderWriter::size)
      .def(
          "add",
          [](MaskFolderWriter& self, const Segmentation& segmentation,
             const std::optional<std::string>& stem) {
            stem ? self.add(segmentation, *stem) : self.add(segmentation);
          },
          py::arg("segmentation"), py::arg("stem") = py::none(),
          R"(Adds a frame's masks under the name of its image without folder and extension; None: the
segmentation's time with 6 decimals. Raises ValueError for a malformed segmentation, for a stem that
is not the segmentation's time, for a time that was added before, and after finish().)")
      .def("__enter__", [](MaskFolderWriter& self) { return &self; })
      .def("__exit__",
           [](MaskFolderWriter& self, const py::object& error, const py::args&) {
             if (error.is_none()) self.finish();
           })
      .def("finish", &MaskFolderWriter::finish,
           "Moves the masks into the folder. Raises RuntimeError that names a file in the way.");
}

void bind_propagator(py::module_& module) {
  py::class_<LockedPropagator>(
      module, "MaskPropagator",
      R"(Moves masks from the frame that they were made from to the current frame. This bridges
the time between two results of a segmenter that is slower than the camera, and late results that
miss an instance.

    masks = propagator.propagate(frame, newest)
    labels = filter.apply(frame, masks, points)

Two propagators share nothing; threads that use one wait for each other.)")
      .def(py::init<double>(), py::kw_only(),
           py::arg("max_age_s") = MaskPropagatorOptions().max_age_s,
           R"(max_age_s: masks of older frames are dropped, seconds

Raises ValueError for an age out of range.)")
      .def("propagate", &LockedPropagator::propagate, py::arg("frame"),
           py::arg("newest") = py::none(), py::call_guard<Unlocked>(),
           R"(Returns the masks at `frame`, given the newest result so far: of this frame or an
earlier one, maybe the same as in the last call, maybe None. Returns None if no masks are known
that are at most max_age_s old.

Call it for every frame, in order, also while there are no masks, so that the history is complete.
The interpreter's lock is released meanwhile.)")
      .def("reset", &LockedPropagator::reset, py::call_guard<Unlocked>(),
           "Forgets everything, like a new propagator.");
}

}  // namespace

void bind_segmenters(py::module_& module) {
  bind_segmenter(module);
  bind_mask_folder(module);
  bind_mask_writer(module);
  bind_propagator(module);
}

}  // namespace dynfilter::python
