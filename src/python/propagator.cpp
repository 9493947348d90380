// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_propagator.hpp"

#include <memory>
#include <mutex>
#include <optional>

#include "dynfilter/detail/errors.hpp"
#include "unlocked.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// MaskPropagator for one thread at a time: others wait.
class LockedPropagator {
 public:
  explicit LockedPropagator(const MaskPropagatorOptions& options)
      : options_(options), propagator_(options) {}

  const MaskPropagatorOptions& options() const { return options_; }

  std::optional<Segmentation> propagate(const FrameView& frame, const Segmentation* newest) {
    std::optional<Segmentation> result;
    if (newest != nullptr) result = *newest;
    const Unlocked unlock;
    const std::lock_guard<std::mutex> lock(mutex_);
    return propagator_.propagate(frame, result);
  }

  void reset() {
    const Unlocked unlock;
    const std::lock_guard<std::mutex> lock(mutex_);
    propagator_.reset();
  }

 private:
  MaskPropagatorOptions options_;
  std::mutex mutex_;
  MaskPropagator propagator_;
};

constexpr const char* options_doc =
    R"(max_age_s: masks of older frames are dropped, seconds

Raises ValueError for an age out of range.)";

}  // namespace

void bind_propagator(py::module_& module) {
  const MaskPropagatorOptions defaults;
  py::class_<LockedPropagator>(
      module, "MaskPropagator",
      R"(Moves masks from the frame that they were made from to the current frame. This bridges
the time between two results of a segmenter that is slower than the camera, and late results that
miss an instance.

    masks = propagator.propagate(frame, newest)
    labels = filter.apply(frame, masks, points)

Two propagators share nothing; threads that use one wait for each other.)")
      .def(py::init([](double max_age_s) {
             return std::make_unique<LockedPropagator>(MaskPropagatorOptions{max_age_s});
           }),
           py::kw_only(), py::arg("max_age_s") = defaults.max_age_s, options_doc)
      .def("propagate", &LockedPropagator::propagate, py::arg("frame"),
           py::arg("newest").none(true) = py::none(),
           R"(Returns the masks at `frame`, given the newest result so far: of this frame or an
earlier one, maybe the same as in the last call, maybe None. Returns None if no masks are known
that are at most max_age_s old.

Call it for every frame, in order, also while there are no masks, so that the history is complete.
The interpreter's lock is released meanwhile.)")
      .def("reset", &LockedPropagator::reset, "Forgets everything, like a new propagator.")
      .def("__repr__", [](const py::object& self) {
        const auto& options = self.cast<const LockedPropagator&>().options();
        return detail::concatenate(type_name(self), "(max_age_s=", options.max_age_s, ")");
      });
}

}  // namespace dynfilter::python
