// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_NETWORKS_YOLO_KIND_HPP
#define DYNFILTER_SRC_NETWORKS_YOLO_KIND_HPP

#include <vector>

#include "loaded_network.hpp"
#include "mask_assembly.hpp"
#include "yolo_decoder.hpp"

namespace dynfilter::detail {

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

#endif  // DYNFILTER_SRC_NETWORKS_YOLO_KIND_HPP
