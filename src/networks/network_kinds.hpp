// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The kinds of networks: the preprocessing and the decoder of each.

#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "class_names.hpp"
#include "detections.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/networks/network_segmenter.hpp"
#include "input_placement.hpp"
#include "mask_assembly.hpp"
#include "network.hpp"
#include "semantic_decoder.hpp"
#include "yolact_decoder.hpp"
#include "yolo_decoder.hpp"

namespace dynfilter::detail {

/// A kind of network. Constructors take the outputs for an empty image, and throw
/// std::runtime_error that says why they are of another kind.
class NetworkKind {
 public:
  virtual ~NetworkKind() = default;

  /// Makes the input [1, 3, rows, columns] of a BGR image.
  virtual PlacedImage input_of(const cv::Mat& image) const = 0;

  /// Returns the number of classes; 0 = unknown.
  int class_count() const { return class_count_; }

  /// Returns the instances in the image, the highest score first. Throws std::runtime_error for
  /// outputs that cannot be scores.
  virtual std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                                       const InputPlacement& placement) const = 0;

 protected:
  NetworkKind(const Network& network, DetectionOptions options)
      : input_(network.input_size()), options_(std::move(options)) {}

  cv::Size input_;
  DetectionOptions options_;
  int class_count_ = 0;
};

inline DetectionOptions detection_options(const NetworkOptions& options, float usual_score,
                                          float iou, int max_detections) {
  return {options.classes, options.score_threshold.value_or(usual_score), iou, max_detections};
}

/// YOLACT: the image is stretched, RGB and normalised.
class YolactKind final : public NetworkKind {
 public:
  YolactKind(const Network& network, const std::vector<NamedTensor>& trial,
             const NetworkOptions& options)
      : NetworkKind(network, detection_options(options, 0.15F, 0.5F, 100)) {
    const YolactOutputs bound = bind_yolact(trial);
    class_count_ = bound.class_count();
    if (bound.priors.empty()) priors_ = yolact_priors(bound.locations.rows, input_);
  }

  /// The published ResNet backbones want ImageNet's mean and deviation, in RGB order.
  PlacedImage input_of(const cv::Mat& image) const override {
    return normalized_rgb(stretch(image, input_), {123.68, 116.78, 103.94}, {58.40, 57.12, 57.38});
  }

  std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                               const InputPlacement& placement) const override {
    const YolactOutputs bound = bind_yolact(outputs);
    const Table priors = priors_.empty() ? bound.priors : priors_;
    return assemble_instances(decode_yolact(bound, priors, input_, options_), bound.prototypes,
                              placement, MaskRule::crop_cells);
  }

 private:
  Table priors_;  // empty if the outputs have them
};

/// YOLO-seg and YOLO detectors: the image is letterboxed in grey 114, RGB from 0 to 1.
class YoloKind final : public NetworkKind {
 public:
  YoloKind(const Network& network, const std::vector<NamedTensor>& trial,
           const NetworkOptions& options)
      : NetworkKind(network, detection_options(options, 0.25F, 0.7F, 300)) {
    class_count_ = bind_yolo(trial, input_).class_count();
  }

  PlacedImage input_of(const cv::Mat& image) const override {
    return normalized_rgb(letterbox(image, input_, cv::Scalar::all(114)), cv::Scalar::all(0),
                          cv::Scalar::all(255));
  }

  std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                               const InputPlacement& placement) const override {
    const YoloOutputs bound = bind_yolo(outputs, input_);
    return assemble_instances(decode_yolo(bound, options_), bound.prototypes, placement,
                              MaskRule::crop_pixels);
  }
};

/// Semantic networks: the image is stretched, RGB, and normalised as the file or the usual network
/// of so many planes wants it.
class SemanticKind final : public NetworkKind {
 public:
  SemanticKind(const Network& network, const std::vector<NamedTensor>& trial,
               const NetworkOptions& options)
      : NetworkKind(network, detection_options(options, 0.5F, 0, 0)) {
    const int planes = bind_semantic(trial, input_).count;
    classes_ = semantic_classes(planes);
    class_count_ = classes_.count(0) > 0 ? 80 : planes;
    if (planes == 1) {  // from 0 to 1 (selfie segmentation)
      deviation_ = cv::Scalar::all(1);
    } else if (planes == 2) {  // from -1 to 1 (PP-HumanSeg)
      mean_ = deviation_ = cv::Scalar::all(0.5);
    } else {  // as for ImageNet
      mean_ = {0.485, 0.456, 0.406};
      deviation_ = {0.229, 0.224, 0.225};
    }
    read(network, "mean", mean_);
    read(network, "std", deviation_);
    for (const int class_id : options.classes) {
      if (classes_.count(class_id) > 0) continue;
      throw_misuse("NetworkSegmenter", concatenate("class ", class_id, " in classes"),
                   "one that " + network.path().string() + " knows");
    }
  }

  PlacedImage input_of(const cv::Mat& image) const override {
    return normalized_rgb(stretch(image, input_), 255 * mean_, 255 * deviation_);
  }

  std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                               const InputPlacement& placement) const override {
    return decode_semantic(bind_semantic(outputs, input_), placement, classes_, options_);
  }

 private:
  /// Replaces the value by one in the file.
  static void read(const Network& network, const char* key, cv::Scalar& value) {
    const std::string text = network.metadata(key);
    if (text.empty()) return;
    const std::vector<double> numbers = numbers_in(text);
    const auto is_usual = [](double number) { return number >= 0 && number <= 1; };
    if (numbers.size() != 3 || !std::all_of(numbers.begin(), numbers.end(), is_usual)) {
      network.fail(std::string("its metadata ") + key + " is " + text +
                   "; want three numbers, of red, green and blue, which run from 0 to 1");
    }
    value = {numbers[0], numbers[1], numbers[2]};
  }

  SemanticClasses classes_;
  cv::Scalar mean_, deviation_;
};

/// A network and its kind.
struct LoadedNetwork {
  Network network;
  std::unique_ptr<NetworkKind> kind;
  std::vector<std::string> class_names;
};

}  // namespace dynfilter::detail
