// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_DEFORMABLE_CONVOLUTION_HPP
#define DYNFILTER_NETWORKS_DEFORMABLE_CONVOLUTION_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <memory>
#include <string>

#include <opencv2/core.hpp>

namespace dynfilter {

struct DeformableConvolutionOptions {
  cv::Size stride = {1, 1};    ///< in x and y
  cv::Size dilation = {1, 1};  ///< in x and y
  int pad_top = 0, pad_left = 0, pad_bottom = 0, pad_right = 0;
  int groups = 1;         ///< of channels, as in any convolution
  int offset_groups = 1;  ///< of input channels that share their offsets and mask
};

/// Modulated deformable convolution (X. Zhu, H. Hu, S. Lin, J. Dai, "Deformable ConvNets v2: More
/// Deformable, Better Results", CVPR 2019, eq. 1; without a mask it is that of J. Dai et al., ICCV
/// 2017), which YOLACT++ is built of and OpenCV lacks. Every tap of the kernel reads the input
/// where an offset moves it, bilinearly interpolated, 0 outside, times the mask. Tensors are those
/// of ONNX's DeformConv and torchvision's deform_conv2d: CV_32F, continuous, four sides.
///
/// The input is sampled into columns, which are multiplied by the weights as OpenCV's dnn module
/// does it; both run on OpenCV's threads. One object serves one thread at a time: it keeps the
/// columns, input channels x taps x output pixels floats.
class DeformableConvolution {
 public:
  /// `weights` [outputs, inputs / groups, taps in y, taps in x]; `bias` has `outputs` numbers in
  /// whatever shape, or none. Copies both. Throws std::invalid_argument for another type or shape
  /// and options out of range.
  DeformableConvolution(const cv::Mat& weights, const cv::Mat& bias,
                        const DeformableConvolutionOptions& options = {});
  DeformableConvolution(DeformableConvolution&&) noexcept;
  DeformableConvolution& operator=(DeformableConvolution&&) noexcept;
  ~DeformableConvolution();

  /// Width and height of the output for an input of this size; not positive where the kernel is
  /// larger than the padded input.
  cv::Size output_size(const cv::Size& input) const;

  /// `input` [batch, inputs, rows, columns]; `offsets` [batch, 2 · offset_groups · taps, output
  /// rows, output columns], a tap's y before its x, taps row by row; `mask` [batch, offset_groups ·
  /// taps, output rows, output columns], or empty = 1 everywhere. `output` becomes [batch, outputs,
  /// output rows, output columns], in its memory where it has this shape. Where an offset is not
  /// finite the sample is 0. Throws std::invalid_argument for another type or shape, with the
  /// output as it was.
  void apply(const cv::Mat& input, const cv::Mat& offsets, const cv::Mat& mask, cv::Mat& output);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Teaches cv::dnn the layer, for the whole process: afterwards cv::dnn::readNetFromONNX reads the
/// standard operator DeformConv, and the custom ones that exporters write: yolact::DCNv2,
/// mmcv::MMCVModulatedDeformConv2d, mmcv::MMCVDeformConv2d (in mmdeploy's domain too), and
/// torchvision::deform_conv2d with its numbers as attributes. Weights and bias must be constants of
/// the model. A type that is registered already, by OpenCV or by the host, is left alone; a second
/// call does nothing. Segmenters of this component call it. Thread-safe.
void register_deformable_convolution();

/// The same for an operator of another name, as OpenCV spells it: "domain.operator".
void register_deformable_convolution(const std::string& layer_type);

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_DEFORMABLE_CONVOLUTION_HPP
