// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_NETWORKS_YOLACT_KIND_HPP
#define DYNFILTER_SRC_NETWORKS_YOLACT_KIND_HPP

#include <vector>

#include "loaded_network.hpp"
#include "mask_assembly.hpp"
#include "yolact_decoder.hpp"

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
    // Of ImageNet, in RGB order, as the published ResNet backbones want it.
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

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_YOLACT_KIND_HPP
