// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// DeformableConvolution run by OpenCV's dnn module, under every name that exporters give it.

#include <array>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/dnn.hpp>

#include "dynfilter/networks/deformable_convolution.hpp"
#include "models.hpp"
#include "networks/deformable_convolution.hpp"
#include "networks/tensors.hpp"
#include "random_tensors.hpp"

namespace dynfilter::detail {
namespace {

using testing::random_tensor;
using testing::tensor;

struct Operator {
  const char* model;
  int channels;
  DeformableConvolutionOptions options;
  bool has_mask, has_bias;
};

std::ostream& operator<<(std::ostream& stream, const Operator& o) { return stream << o.model; }

DeformableConvolutionOptions layer_options(cv::Size stride, cv::Size dilation,
                                           std::array<int, 4> pads, int groups) {
  DeformableConvolutionOptions options;
  options.stride = stride;
  options.dilation = dilation;
  options.pad_top = pads[0];
  options.pad_left = pads[1];
  options.pad_bottom = pads[2];
  options.pad_right = pads[3];
  options.groups = options.offset_groups = groups;
  return options;
}

class DeformableLayer : public testing::Models, public ::testing::WithParamInterface<Operator> {};

/// Weights as make_models.py computes them.
cv::Mat weights_of(const std::vector<int>& shape) {
  cv::Mat weights = tensor(shape);
  for (int i = 0; i < int(weights.total()); ++i)
    weights.ptr<float>()[i] = float(i * 5 % 13 - 6) / 8;
  return weights;
}

TEST_P(DeformableLayer, MatchesTheClass) {
  register_deformable_convolution();
  const Operator& o = GetParam();
  cv::dnn::Net net = cv::dnn::readNetFromONNX(model(o.model).string());
  std::mt19937 random(1);
  for (int trial = 0; trial < 2; ++trial) {
    const cv::Mat input = random_tensor(random, {1, o.channels, 9, 10}, -1, 1);
    net.setInput(input);
    std::vector<cv::Mat> outputs;
    std::vector<cv::String> names = {"y", "offsets"};
    if (o.has_mask) names.push_back("mask");
    net.forward(outputs, names);

    cv::Mat bias;
    if (o.has_bias) bias = (cv::Mat_<float>(1, 4) << 0.5, -0.25, 0.125, 1.0);
    DeformableConvolution convolution(weights_of({4, o.channels / o.options.groups, 3, 3}), bias,
                                      o.options);
    cv::Mat want;
    convolution.apply(input, outputs[1], o.has_mask ? outputs[2] : cv::Mat(), want);
    ASSERT_EQ(shape_of(outputs[0]), shape_of(want));
    EXPECT_LT(cv::norm(outputs[0].reshape(1, 1), want.reshape(1, 1), cv::NORM_INF), 1e-5);
    EXPECT_GT(cv::norm(want.reshape(1, 1), cv::NORM_INF), 0.1);
  }
}

const DeformableConvolutionOptions wide = layer_options({2, 1}, {1, 2}, {2, 1, 2, 1}, 2);

INSTANTIATE_TEST_SUITE_P(
    All, DeformableLayer,
    ::testing::Values(
        Operator{"deform_conv", 4, layer_options({1, 2}, {2, 1}, {0, 1, 2, 3}, 2), true, true},
        Operator{"deform_conv_plain", 3, {}, false, false},
        Operator{"yolact_dcn", 3, layer_options({2, 2}, {1, 1}, {1, 1, 1, 1}, 1), true, true},
        Operator{"mmcv_dcn", 4, wide, true, true}, Operator{"mmdeploy_dcn", 4, wide, true, true},
        Operator{"mmcv_dcn_v1", 4, wide, false, false},
        Operator{"torchvision_dcn", 4, wide, true, true}),
    [](const auto& chosen) { return std::string(chosen.param.model); });

}  // namespace
}  // namespace dynfilter::detail
