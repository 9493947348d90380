// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

/// @file
/// NetworkSegmenter recognises the kind of a network by the shapes of its outputs, in any order.
/// C is the number of classes, P of prototypes, N of anchors:
///
/// - YOLO-seg, with prototypes [1, P, h, w]: [1, 4+C+P, N] (YOLOv8, YOLO11), [1, 3N, 5+C+P] (v5),
///   [1, K, 6+P] (YOLO26), or three heads by examples/cut_yolo_heads.py. Input: RGB, letterboxed.
/// - YOLO detectors, the same without prototypes: P = 0, two heads, or YOLOv6's [1, N, 5+C].
///   Instances have boxes alone, of which CompensationRule::depth makes masks.
/// - YOLACT and YOLACT++: locations [1, N, 4], confidences [1, N, C+1], coefficients [1, N, P],
///   prototypes, optionally priors [N, 4]. Input: RGB, stretched, normalised as for ResNet. A
///   YOLACT++ has its deformable convolutions as layers DCNv2, DeformConv (ONNX 19) or mmcv's
///   MMCVModulatedDeformConv2d, slow here; masks are not scored anew (its maskiou_net).
/// - Semantic: probabilities or logits [1, C, h, w], [1, h, w, C] or [1, h, w]. Input: RGB,
///   stretched, normalised by `mean` and `std` of the file's metadata.
///
/// OpenCV 4.6 runs end-to-end networks and heads, 4.7 all. Of a semantic network, the connected
/// parts of a class are instances, their boxes 20 px larger. Classes are COCO's, by C: 1 (persons),
/// 2 (background and persons), 12 (CamVid), 19 (Cityscapes), 21 (Pascal VOC), 150 (ADE20K); else
/// channels, of which the first is background. `mean` and `std` are metadata for colours from 0 to
/// 1; without them: 0 to 1 (C = 1), -1 to 1 (C = 2), or as for ImageNet. Sources: G. Jocher et al.,
/// Ultralytics; D. Bolya et al., "YOLACT", ICCV 2019.

#pragma once

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

/// Segmenter that runs a network from an ONNX file by OpenCV's dnn module; the file's head says
/// which. Instances are sorted by score, the highest first. A box is the smallest rectangle of
/// whole pixels that holds the network's box, clipped to the image. A mask has at least one pixel
/// and may reach a few pixels beyond the box (YOLACT). Detections without a pixel in the image are
/// dropped; track_id is never set. segment() throws std::invalid_argument for a frame without an
/// 8-bit grey or BGR image, and std::runtime_error that names the model if the network fails or its
/// output cannot be scores. One object serves one thread at a time; several may run at once.
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
