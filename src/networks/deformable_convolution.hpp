// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_NETWORKS_DEFORMABLE_CONVOLUTION_HPP
#define DYNFILTER_SRC_NETWORKS_DEFORMABLE_CONVOLUTION_HPP

#include <memory>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Attributes of the layer, as in ONNX's DeformConv.
struct DeformableConvolutionOptions {
  cv::Size stride = {1, 1};    ///< step of the kernel in x and y
  cv::Size dilation = {1, 1};  ///< distance of the kernel's taps in x and y
  /// @{
  /// Zero padding of the input on this side, pixels.
  int pad_top = 0, pad_left = 0, pad_bottom = 0, pad_right = 0;
  /// @}
  int groups = 1;         ///< groups of channels, as in any convolution
  int offset_groups = 1;  ///< groups of input channels that share their offsets and mask
};

/// Modulated deformable convolution, a layer of YOLACT++ that OpenCV lacks. Source: X. Zhu, H. Hu,
/// S. Lin, J. Dai, "Deformable ConvNets v2: More Deformable, Better Results", CVPR 2019, eq. 1;
/// without a mask, J. Dai et al., ICCV 2017.
///
/// Every tap of the kernel reads the input at a place shifted by an offset, bilinearly
/// interpolated, 0 outside, and multiplies it by the mask. Tensors are laid out as in ONNX's
/// DeformConv and torchvision's deform_conv2d: CV_32F, continuous, four dimensions.
///
/// The input is sampled into columns, which are multiplied by the weights as in OpenCV's dnn
/// module; both steps run on OpenCV's threads. One object serves one thread at a time, because it
/// keeps the columns: input channels x taps x output pixels floats.
class DeformableConvolution {
 public:
  /// Copies the weights and the bias. `weights` is [outputs, inputs / groups, taps in y, taps in
  /// x]; `bias` has `outputs` numbers in any shape, or none. Throws std::invalid_argument for
  /// another type or shape and for options out of range.
  DeformableConvolution(const cv::Mat& weights, const cv::Mat& bias,
                        const DeformableConvolutionOptions& options = {});
  /// Moves the layer; the source may only be destroyed or assigned to.
  DeformableConvolution(DeformableConvolution&&) noexcept;
  /// Moves the layer; the source may only be destroyed or assigned to.
  DeformableConvolution& operator=(DeformableConvolution&&) noexcept;
  ~DeformableConvolution();

  /// Returns width and height of the output for an input of this size. They are not positive if the
  /// kernel is larger than the padded input.
  cv::Size output_size(const cv::Size& input) const;

  /// Applies the layer. The arguments are
  /// - `input` [batch, inputs, rows, columns];
  /// - `offsets` [batch, 2 · offset_groups · taps, output rows, output columns], taps row by row,
  ///   each tap's y before its x;
  /// - `mask` [batch, offset_groups · taps, output rows, output columns], or empty = 1 everywhere;
  /// - `output`, which becomes [batch, outputs, output rows, output columns] and reuses its memory
  ///   if it has this shape.
  ///
  /// A sample whose offset is not finite is 0. Throws std::invalid_argument for another type or
  /// shape, and then leaves the output unchanged.
  void apply(const cv::Mat& input, const cv::Mat& offsets, const cv::Mat& mask, cv::Mat& output);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_DEFORMABLE_CONVOLUTION_HPP
