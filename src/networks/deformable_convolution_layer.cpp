// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// DeformableConvolution as a layer of cv::dnn.

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/dnn.hpp>
#include <opencv2/dnn/layer.hpp>

#include "deformable_convolution.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/networks/deformable_convolution.hpp"

namespace dynfilter {
namespace {

// --- The attributes, as exporters spell them -----------------------------------------------------

/// Returns the numbers of an attribute; some exporters write them as text.
std::vector<int> numbers(const cv::dnn::DictValue& value) {
  std::vector<int> result;
  for (int i = 0; i < value.size(); ++i) {
    result.push_back(value.isString() ? std::stoi(value.get<cv::String>(i)) : value.get<int>(i));
  }
  return result;
}

std::optional<std::vector<int>> attribute(const cv::dnn::LayerParams& params,
                                          std::initializer_list<const char*> spellings) {
  for (const char* spelling : spellings) {
    if (params.has(spelling)) return numbers(params.get(spelling));
  }
  return {};
}

int number(const cv::dnn::LayerParams& params, std::initializer_list<const char*> spellings,
           int otherwise) {
  const std::optional<std::vector<int>> value = attribute(params, spellings);
  return value && !value->empty() ? value->front() : otherwise;
}

/// Returns height and width from an attribute of two numbers or one, or from two attributes.
cv::Size height_and_width(const cv::dnn::LayerParams& params,
                          std::initializer_list<const char*> together,
                          std::initializer_list<const char*> heights,
                          std::initializer_list<const char*> widths, int otherwise) {
  const std::optional<std::vector<int>> both = attribute(params, together);
  if (both && !both->empty()) return {both->back(), both->front()};
  return {number(params, widths, otherwise), number(params, heights, otherwise)};
}

detail::DeformableConvolutionOptions options_of(const cv::dnn::LayerParams& params) {
  detail::DeformableConvolutionOptions options;
  options.stride = height_and_width(params, {"stride", "strides"}, {"stride_h"}, {"stride_w"}, 1);
  options.dilation = height_and_width(params, {"dilation", "dilations"}, {"dilation_h", "dil_h"},
                                      {"dilation_w", "dil_w"}, 1);
  const std::optional<std::vector<int>> pads = attribute(params, {"pad", "pads", "padding"});
  if (pads && pads->size() == 4) {  // ONNX: begin of y and x, end of y and x
    options.pad_top = (*pads)[0];
    options.pad_left = (*pads)[1];
    options.pad_bottom = (*pads)[2];
    options.pad_right = (*pads)[3];
  } else {
    const cv::Size pad = height_and_width(params, {"pad", "pads", "padding"},
                                          {"padding_h", "pad_h"}, {"padding_w", "pad_w"}, 0);
    options.pad_top = options.pad_bottom = pad.height;
    options.pad_left = options.pad_right = pad.width;
  }
  options.groups = number(params, {"group", "groups", "n_weight_grps"}, 1);
  options.offset_groups = number(params,
                                 {"offset_group", "offset_groups", "deform_groups",
                                  "deformable_groups", "deformable_group", "n_offset_grps"},
                                 1);
  return options;
}

// --- The layer -----------------------------------------------------------------------------------

/// Wraps the convolution as a layer. Inputs are the tensor, the offsets and perhaps the mask;
/// weights and bias are the blobs.
class DeformableConvolutionLayer final : public cv::dnn::Layer {
 public:
  explicit DeformableConvolutionLayer(const cv::dnn::LayerParams& params) {
    setParamsFrom(params);
    if (blobs.empty() || blobs[0].dims != 4) {
      CV_Error(cv::Error::StsNotImplemented,
               "the weights of a deformable convolution must be a constant of the model");
    }
    try {
      convolution_ = std::make_unique<detail::DeformableConvolution>(
          blobs[0], blobs.size() > 1 ? blobs[1] : cv::Mat(), options_of(params));
    } catch (const std::logic_error& error) {  // std::stoi's too
      CV_Error(cv::Error::StsBadArg, error.what());
    }
    outputs_ = blobs[0].size[0];
  }

  bool getMemoryShapes(const std::vector<cv::dnn::MatShape>& inputs, int /*required_outputs*/,
                       std::vector<cv::dnn::MatShape>& outputs,
                       std::vector<cv::dnn::MatShape>& /*internals*/) const override {
    if ((inputs.size() != 2 && inputs.size() != 3) || inputs[0].size() != 4) {
      CV_Error(
          cv::Error::StsBadArg,
          "a deformable convolution takes a tensor of four dimensions, offsets and perhaps a mask");
    }
    const cv::Size size = convolution_->output_size({inputs[0][3], inputs[0][2]});
    outputs.assign(1, {inputs[0][0], outputs_, size.height, size.width});
    return false;
  }

  void forward(cv::InputArrayOfArrays inputs, cv::OutputArrayOfArrays outputs,
               cv::OutputArrayOfArrays internals) override {
    if (inputs.depth() == CV_16S) {  // OpenCV's code for half precision
      forward_fallback(inputs, outputs, internals);
      return;
    }
    std::vector<cv::Mat> in, out;
    inputs.getMatVector(in);
    outputs.getMatVector(out);
    try {
      convolution_->apply(in.at(0), in.at(1), in.size() > 2 ? in[2] : cv::Mat(), out.at(0));
    } catch (const std::invalid_argument& error) {
      CV_Error(cv::Error::StsBadArg, error.what());
    }
  }

 private:
  std::unique_ptr<detail::DeformableConvolution> convolution_;
  int outputs_ = 0;
};

cv::Ptr<cv::dnn::Layer> make_layer(cv::dnn::LayerParams& params) {
  return cv::Ptr<cv::dnn::Layer>(new DeformableConvolutionLayer(params));
}

// --- Registration --------------------------------------------------------------------------------

/// Tells whether a layer of this type is registered; false on OpenCV 4.2, which cannot tell.
template <class Factory>
auto is_registered(const std::string& type, int) -> decltype(Factory::isLayerRegistered(type)) {
  return Factory::isLayerRegistered(type);
}
template <class Factory>
bool is_registered(const std::string& /*type*/, long) {
  return false;
}

}  // namespace

void register_deformable_convolution() {
  static const bool is_done = [] {
    for (const char* type : {"DeformConv", "yolact.DCNv2", "mmcv.MMCVModulatedDeformConv2d",
                             "mmcv.MMCVDeformConv2d", "mmdeploy.MMCVModulatedDeformConv2d",
                             "mmdeploy.MMCVDeformConv2d", "torchvision.deform_conv2d"}) {
      if (is_registered<cv::dnn::LayerFactory>(type, 0)) continue;
      cv::dnn::LayerFactory::registerLayer(type, make_layer);
    }
    return true;
  }();
  static_cast<void>(is_done);
}

}  // namespace dynfilter
