// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/networks/network_segmenter.hpp"
#include "unlocked.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

/// Network for one thread at a time: others wait.
class LockedNetwork final : public Segmenter {
 public:
  LockedNetwork(const std::filesystem::path& model, const NetworkOptions& options)
      : network_(model, options) {}

  const NetworkSegmenter& network() const { return network_; }

 private:
  Segmentation do_segment(const FrameView& frame) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    return network_.segment(frame);
  }

  std::mutex mutex_;
  NetworkSegmenter network_;
};

constexpr const char* load_doc =
    R"(Loads an ONNX file and runs it once, so that errors show here and the first frame does not
wait.

classes: classes whose instances are returned; empty = all
score_threshold: score that instances must exceed; None = 0.25 (YOLO), 0.15 (YOLACT), 0.5 (semantic)
input_size: (width, height) of the network's input, for a model that leaves them open
device: what OpenCV runs it on, "cpu", "opencl", "cuda" or "openvino"

Raises RuntimeError that names a file that is missing, truncated or of no known kind, and
ValueError for options out of range.)";

std::unique_ptr<LockedNetwork> load(const std::filesystem::path& model, std::vector<int> classes,
                                    std::optional<float> score_threshold,
                                    const cv::Size& input_size, const std::string& device) {
  const Unlocked unlock;
  return std::make_unique<LockedNetwork>(
      model, NetworkOptions{std::move(classes), score_threshold, input_size, device});
}

}  // namespace

void bind_networks(py::module_& module) {
  py::class_<LockedNetwork, Segmenter>(
      module, "NetworkSegmenter",
      R"(Segmenter that runs a network from an ONNX file by OpenCV's dnn module. Recognises its
kind, YOLO-seg, YOLACT or a semantic network, by its outputs.

Instances are sorted by score, the highest first. Frames need an 8-bit grey or BGR image. Threads
that use one network wait for each other; several networks may run at once.)")
      .def(py::init(&load), py::arg("model"), py::kw_only(),
           py::arg("classes") = std::vector<int>(), py::arg("score_threshold") = py::none(),
           py::arg("input_size") = cv::Size(), py::arg("device") = "cpu", load_doc)
      .def_property_readonly(
          "class_names", [](const LockedNetwork& self) { return self.network().class_names(); },
          "names of the classes, by class_id; empty if they are not known")
      .def(
          "class_id",
          [](const LockedNetwork& self, const std::string& class_name) {
            return self.network().class_id(class_name);
          },
          py::arg("name"), "Returns the class with this name, or None.")
      .def_property_readonly(
          "input_size", [](const LockedNetwork& self) { return self.network().input_size(); },
          "(width, height) of the network's input; images are resized to it");
}

}  // namespace dynfilter::python
