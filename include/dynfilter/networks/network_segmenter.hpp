// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_NETWORK_SEGMENTER_HPP
#define DYNFILTER_NETWORKS_NETWORK_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>
#include <functional>
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

/// What all networks have in common. What is not set is the usual value of the network's kind.
struct NetworkOptions {
  /// The classes whose instances are wanted; empty = all. The filter has its own list of dynamic
  /// classes, and instances of others are evidence too: leave this empty unless time is short.
  std::vector<int> classes;
  /// Instances have a higher score. YOLO 0.25, YOLACT 0.15.
  std::optional<float> score_threshold;
  /// Of two boxes of one class that overlap by more, intersection over union, the one of lower
  /// score is left out. YOLO 0.7, YOLACT 0.5. Without effect where the network does it itself.
  std::optional<float> iou_threshold;
  /// The best so many are kept. YOLO 300, YOLACT 100.
  std::optional<int> max_instances;
  /// In the order of the classes. Empty = those in the model's file (metadata `names`, as
  /// Ultralytics writes them), else COCO's if there are 80 classes, else none.
  std::vector<std::string> class_names;
  /// Width and height of the network's input, for a model that leaves them open; others have their
  /// own, and a size that differs from it is refused.
  cv::Size input_size;
  /// The camera's roll in a frame, in radians: by how much the camera was turned clockwise about
  /// the direction of its view, seen from behind it. With the direction of gravity (x, y, z) in the
  /// camera's axes (x right, y down) it is atan2(x, y). The image is turned upright before the
  /// network sees it, and boxes and masks are turned back: networks know few people who lie on the
  /// ceiling. Empty = images are taken as they are. Called by the thread that calls segment().
  std::function<double(const FrameView&)> roll_rad;
};

/// A network from an ONNX file as a segmenter, run by OpenCV's dnn module on the CPU. Made by
/// make_network_segmenter, YoloSegmenter or YolactSegmenter.
///
/// Instances are sorted by score, the highest first. Boxes are clipped to the image: the smallest
/// rectangle of whole pixels that holds the network's box, or that box turned back. Masks have at
/// least one pixel, may reach a few pixels beyond the box (YOLACT), and are cut out: mask_origin
/// says where they lie. What has no pixel in the image is no instance. track_id is never set.
///
/// segment() throws std::invalid_argument for a frame without an 8-bit grey or BGR image, and for a
/// roll that is not finite; std::runtime_error that names the model where the network fails or puts
/// out what cannot be scores. The frame's image is left as it is.
///
/// One object serves one thread at a time, for the network's memory is its own; several objects may
/// run at once. The threads are OpenCV's (cv::setNumThreads).
class NetworkSegmenter : public Segmenter {
 public:
  ~NetworkSegmenter() override;
  NetworkSegmenter(NetworkSegmenter&&) noexcept;
  NetworkSegmenter& operator=(NetworkSegmenter&&) noexcept;

  /// The names of the classes, by class_id; empty where they are not known.
  const std::vector<std::string>& class_names() const;

  /// The class of that name, if there is one.
  std::optional<int> class_id(const std::string& name) const;

  /// Width and height that images are brought to before the network sees them.
  cv::Size input_size() const;

 protected:
  explicit NetworkSegmenter(std::unique_ptr<detail::LoadedNetwork> network);

 private:
  friend std::unique_ptr<NetworkSegmenter> make_network_segmenter(
      const std::filesystem::path& model, const NetworkOptions& options);

  Segmentation do_segment(const FrameView& frame) override;

  std::unique_ptr<detail::LoadedNetwork> network_;
};

/// Loads a model and looks at its inputs and outputs to see what it is: YOLOv8-seg or YOLO11-seg
/// (see YoloSegmenter), YOLACT or YOLACT++ (see YolactSegmenter). It is run once, so that what it
/// cannot do shows here, and the first frame does not wait.
///
/// Throws std::runtime_error that names the file for one that is missing, truncated or no ONNX
/// model, keeps its weights in another file, has an operator that this OpenCV lacks, more than one
/// input, or outputs that are none of those; where a newer OpenCV or examples/cut_yolo_heads.py
/// would help, it says so. Throws std::invalid_argument for options out of range. OpenCV logs what
/// fails in it to the standard error, too.
std::unique_ptr<NetworkSegmenter> make_network_segmenter(const std::filesystem::path& model,
                                                         const NetworkOptions& options = {});

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_NETWORK_SEGMENTER_HPP
