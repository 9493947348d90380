// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_NETWORKS_NETWORK_KINDS_HPP
#define DYNFILTER_SRC_NETWORKS_NETWORK_KINDS_HPP

#include <vector>

#include "loaded_network.hpp"
#include "mask_assembly.hpp"
#include "yolact_decoder.hpp"
#include "yolo_decoder.hpp"

namespace dynfilter::detail {

/// YOLACT's preprocessing and decoding: the image is stretched, RGB and normalised.
class YolactKind final : public NetworkKind {
 public:
  YolactKind(const cv::Size& input, const NetworkOptions& options)
      : input_(input), options_(detection_options(options, {0.15F, 0.5F, 100})) {}

  PlacedImage place(const cv::Mat& image, const cv::Size& input) const override {
    return stretch(image, input);
  }

  cv::Mat tensor_of(const PlacedImage& placed) const override {
    // The published ResNet backbones want those of ImageNet, in RGB order.
    const cv::Scalar mean(123.68, 116.78, 103.94), deviation(58.40, 57.12, 57.38);
    return normalized_rgb(placed.pixels, mean, deviation);
  }

  /// Binds the outputs, and computes the priors if the outputs lack them.
  int prepare(const std::vector<NamedTensor>& outputs) override {
    const YolactOutputs bound = bind_yolact(outputs);
    if (bound.priors.rows == 0) priors_ = yolact_priors(bound.locations.rows, input_);
    return bound.class_count();
  }

  std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                               const InputPlacement& placement) const override {
    const YolactOutputs bound = bind_yolact(outputs);
    const Table priors = priors_.empty() ? bound.priors : rows_first(priors_);
    return assemble_instances(decode_yolact(bound, priors, input_, options_), bound.prototypes,
                              placement, MaskRule::crop_cells);
  }

 private:
  cv::Size input_;
  DetectionOptions options_;
  cv::Mat priors_;  // empty if the outputs have them
};

/// YOLO-seg's preprocessing and decoding: letterboxed in grey 114, RGB from 0 to 1.
class YoloKind final : public NetworkKind {
 public:
  YoloKind(const cv::Size& input, const NetworkOptions& options)
      : input_(input), options_(detection_options(options, {0.25F, 0.7F, 300})) {}

  PlacedImage place(const cv::Mat& image, const cv::Size& input) const override {
    return letterbox(image, input, cv::Scalar::all(114));
  }

  cv::Mat tensor_of(const PlacedImage& placed) const override {
    return normalized_rgb(placed.pixels, cv::Scalar::all(0), cv::Scalar::all(255));
  }

  int prepare(const std::vector<NamedTensor>& outputs) override {
    return bind_yolo(outputs, input_).class_count();
  }

  std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                               const InputPlacement& placement) const override {
    const YoloOutputs bound = bind_yolo(outputs, input_);
    return assemble_instances(decode_yolo(bound, options_), bound.prototypes, placement,
                              MaskRule::crop_pixels);
  }

 private:
  cv::Size input_;
  DetectionOptions options_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_NETWORK_KINDS_HPP
