// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_NETWORK_SEGMENTER_HPP
#define DYNFILTER_NETWORKS_NETWORK_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {
namespace detail {
struct LoadedNetwork;
}

/// Options of all networks. An unset option has the usual value of the network's kind.
struct NetworkOptions {
  /// Classes whose instances are returned; empty = all. The filter has its own list of dynamic
  /// classes, MaskCullerOptions::dynamic_classes. Instances of other classes have no effect on its
  /// stages; stages of your own may read them.
  std::vector<int> classes;
  /// Score that instances must exceed. Default: YOLO 0.25, YOLACT 0.15.
  std::optional<float> score_threshold;
  /// Width and height of the network's input, for a model that leaves them open. A model with a
  /// fixed size refuses another one.
  cv::Size input_size;
};

/// Segmenter that runs a network from an ONNX file by OpenCV's dnn module on the CPU. Made by
/// make_network_segmenter, YoloSegmenter or YolactSegmenter.
///
/// Instances are sorted by score, the highest first. A box is the smallest rectangle of whole
/// pixels that holds the network's box, clipped to the image. A mask has at least
/// one pixel and may reach a few pixels beyond the box (YOLACT); only its bounding rectangle is
/// stored, at mask_origin. Detections without a pixel in the image are dropped. track_id is never
/// set.
///
/// segment() throws std::invalid_argument for a frame without an 8-bit grey or BGR image. It throws
/// std::runtime_error that names the model if the network fails
/// or its output cannot be scores. The frame's image is not changed.
///
/// One object serves one thread at a time, because the network's memory is its own; several objects
/// may run at once. The threads are OpenCV's (cv::setNumThreads).
class NetworkSegmenter : public Segmenter {
 public:
  ~NetworkSegmenter() override;
  /// Moves the network; the source may only be destroyed or assigned to.
  NetworkSegmenter(NetworkSegmenter&&) noexcept;
  /// Moves the network; the source may only be destroyed or assigned to.
  NetworkSegmenter& operator=(NetworkSegmenter&&) noexcept;

  /// Names of the classes, by class_id: those in the model's file (metadata `names`, as Ultralytics
  /// writes them), else COCO's if there are 80 classes, else none.
  const std::vector<std::string>& class_names() const;

  /// Returns the class with this name, if there is one.
  std::optional<int> class_id(const std::string& name) const;

  /// Width and height of the network's input; images are resized to it.
  cv::Size input_size() const;

 protected:
  /// Takes a loaded network, for the classes of this component.
  explicit NetworkSegmenter(std::unique_ptr<detail::LoadedNetwork> network);

 private:
  friend std::unique_ptr<NetworkSegmenter> make_network_segmenter(
      const std::filesystem::path& model, const NetworkOptions& options);

  Segmentation do_segment(const FrameView& frame) override;

  std::unique_ptr<detail::LoadedNetwork> network_;
};

/// Loads a model and recognises its kind by its inputs and outputs: YOLOv8-seg or YOLO11-seg (see
/// YoloSegmenter) or YOLACT (see YolactSegmenter). Runs it once, so that errors show here
/// and the first frame does not wait.
///
/// Throws std::runtime_error that names the file if it is missing, truncated or not an ONNX model,
/// keeps its weights in another file, has an operator that this OpenCV lacks, more than one input,
/// or outputs of no known kind. The message says so if a newer OpenCV or examples/cut_yolo_heads.py
/// would help. Throws std::invalid_argument for options out of range. OpenCV also logs its own
/// failures to the standard error.
std::unique_ptr<NetworkSegmenter> make_network_segmenter(const std::filesystem::path& model,
                                                         const NetworkOptions& options = {});

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_NETWORK_SEGMENTER_HPP
