// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <opencv2/dnn.hpp>

namespace dynfilter::detail {

/// Makes a modulated deformable convolution (X. Zhu et al., "Deformable ConvNets v2", CVPR 2019),
/// which reads each of a kernel's K pixels at a place of its own, bilinearly and 0 outside, and
/// weighs it. Inputs, CV_32F: image [N, C, H, W]; offsets [N, 2GK, h, w], y and x in turn, for G
/// groups of channels; weights [N, GK, h, w], or nothing for 1. Blobs: kernels [M, C, rows,
/// columns], perhaps biases [M]. Throws cv::Exception for what does not fit.
cv::Ptr<cv::dnn::Layer> make_deformable_convolution(cv::dnn::LayerParams& params);

}  // namespace dynfilter::detail
