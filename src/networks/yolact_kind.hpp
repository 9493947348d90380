// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_NETWORKS_YOLACT_KIND_HPP
#define DYNFILTER_SRC_NETWORKS_YOLACT_KIND_HPP

#include <stdexcept>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/networks/yolact_segmenter.hpp"
#include "loaded_network.hpp"
#include "mask_assembly.hpp"
#include "yolact_decoder.hpp"

namespace dynfilter::detail {

/// Throws std::invalid_argument for options out of range; the message begins with `component`.
void require_valid(const YolactOptions& options, const char* component);

/// YOLACT's preprocessing and decoding: the image is stretched, RGB and normalised.
class YolactKind final : public NetworkKind {
 public:
  YolactKind(const cv::Size& input, const YolactOptions& options)
      : input_(input),
        mean_(options.mean_rgb),
        deviation_(options.deviation_rgb),
        decoding_{detection_options(options, {0.15F, 0.5F, 100}), options.suppression,
                  options.candidates_per_class},
        priors_(options.priors.clone()) {}

  /// Returns the colour that becomes 0; it surrounds an image turned on its canvas.
  cv::Scalar border() const override { return {mean_[2], mean_[1], mean_[0]}; }

  PlacedImage place(const PlacedImage& upright, const cv::Size& input) const override {
    return stretch(upright, input);
  }

  cv::Mat tensor_of(const PlacedImage& placed) const override {
    return normalized_rgb(placed.pixels, mean_, deviation_);
  }

  /// Binds the outputs, and computes the priors if neither options nor outputs have them.
  int prepare(const std::vector<NamedTensor>& outputs) override {
    const YolactOutputs bound = bind_yolact(outputs);
    if (priors_.empty() && bound.priors.rows == 0) {
      priors_ = yolact_priors(bound.locations.rows, input_);
    }
    require_priors(bound);
    return bound.class_count();
  }

  std::vector<Instance> decode(const std::vector<NamedTensor>& outputs,
                               const InputPlacement& placement) const override {
    const YolactOutputs bound = bind_yolact(outputs);
    require_priors(bound);
    const Table priors = priors_.empty() ? bound.priors : rows_first(priors_);
    return assemble_instances(decode_yolact(bound, priors, input_, decoding_), bound.prototypes,
                              placement, MaskRule::crop_cells);
  }

 private:
  void require_priors(const YolactOutputs& outputs) const {
    if (!priors_.empty() && priors_.rows != outputs.locations.rows) {
      throw std::runtime_error(concatenate("there are ", priors_.rows, " priors for ",
                                           outputs.locations.rows, " locations"));
    }
  }

  cv::Size input_;
  cv::Scalar mean_, deviation_;
  YolactDecoding decoding_;
  cv::Mat priors_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_YOLACT_KIND_HPP
