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
  /// Score that instances must exceed, of semantic networks each pixel. Default: YOLO 0.25, YOLACT
  /// 0.15, semantic networks 0.5.
  std::optional<float> score_threshold;
  /// Width and height of the network's input, for a model that leaves them open. A model with a
  /// fixed size refuses another one.
  cv::Size input_size;
  /// What OpenCV runs it on: "cpu", "opencl" (a GPU), "cuda" or "openvino" (the CPU, by OpenVINO).
  /// A device that this OpenCV lacks is a std::runtime_error.
  std::string device = "cpu";
};

/// Segmenter that runs a network from an ONNX file by OpenCV's dnn module. It recognises the kind
/// by the shapes of the outputs, in any order, with C classes, P prototypes and N anchors:
///
/// - YOLO-seg (G. Jocher et al., Ultralytics): prototypes [1, P, h, w] with one output [1, 4+C+P,
/// N]
///   (YOLOv8, YOLO11), [1, 3N, 5+C+P] (YOLOv5) or [1, K, 6+P] (end-to-end, YOLO26); or with raw
///   heads [1, 64, N], [1, C, N], [1, P, N] by examples/cut_yolo_heads.py. OpenCV 4.6 runs the
///   last two, 4.7 all. The image is letterboxed; the input is RGB from 0 to 1.
/// - YOLACT (D. Bolya et al., ICCV 2019; not YOLACT++): locations [1, N, 4], confidences
///   [1, N, C+1], coefficients [1, N, P], prototypes, and optionally priors [N, 4]. The image is
///   stretched and normalised for ResNet. An object that resembles several classes becomes an
///   instance of each.
/// - Semantic networks: scores [1, C, h, w], [1, h, w, C] or [1, h, w], probabilities or logits.
///   Instances are the connected parts of a class, their boxes 20 px larger. Classes are COCO's, by
///   C: 1 (persons), 2 (background and persons), 12 (CamVid), 19 (Cityscapes), 21 (Pascal VOC), 150
///   (ADE20K); else channels, of which the first is background. The image is stretched; the input
///   is RGB, normalised by the numbers `mean` and `std` in the file's metadata, for colours from 0
///   to 1; by default from 0 to 1 (C = 1), -1 to 1 (C = 2) or as for ImageNet.
///
/// Instances are sorted by score, the highest first. A box is the smallest rectangle of whole
/// pixels that holds the network's box, clipped to the image. A mask has at least one pixel and may
/// reach a few pixels beyond the box (YOLACT); only its bounding rectangle is stored, at
/// mask_origin. Detections without a pixel in the image are dropped. track_id is never set.
///
/// segment() throws std::invalid_argument for a frame without an 8-bit grey or BGR image. It throws
/// std::runtime_error that names the model if the network fails or its output cannot be scores. The
/// frame's image is not changed.
///
/// One object serves one thread at a time, because the network's memory is its own; several objects
/// may run at once. The threads are OpenCV's (cv::setNumThreads).
class NetworkSegmenter final : public Segmenter {
 public:
  /// Loads a model and runs it once, so that errors show here and the first frame does not wait.
  ///
  /// Throws std::runtime_error that names the file if it is missing, truncated or not an ONNX
  /// model, keeps its weights in another file, has an operator that this OpenCV lacks, more than
  /// one input, or outputs of no known kind. The message says so if another export, a newer OpenCV
  /// or examples/cut_yolo_heads.py would help. Throws std::invalid_argument for options out of
  /// range. OpenCV also logs its own failures to the standard error.
  explicit NetworkSegmenter(const std::filesystem::path& model, const NetworkOptions& options = {});
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

 private:
  Segmentation do_segment(const FrameView& frame) override;

  std::unique_ptr<detail::LoadedNetwork> network_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_NETWORK_SEGMENTER_HPP
