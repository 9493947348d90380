// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_DEFORMABLE_CONVOLUTION_HPP
#define DYNFILTER_NETWORKS_DEFORMABLE_CONVOLUTION_HPP

#include "dynfilter/detail/require_cxx17.hpp"

namespace dynfilter {

/// Registers modulated deformable convolution, a layer of YOLACT++ that OpenCV lacks, with cv::dnn,
/// for the whole process. cv::dnn::readNetFromONNX then reads the standard operator DeformConv and
/// the exporters' custom ones: yolact::DCNv2, mmcv::MMCVModulatedDeformConv2d,
/// mmcv::MMCVDeformConv2d (also in mmdeploy's domain), and torchvision::deform_conv2d with its
/// numbers as attributes.
///
/// Weights and bias must be constants of the model. A type that OpenCV or the host registered
/// already is left alone; a second call does nothing. The segmenters of this component call it.
/// Thread-safe.
void register_deformable_convolution();

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_DEFORMABLE_CONVOLUTION_HPP
