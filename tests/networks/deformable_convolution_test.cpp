// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/deformable_convolution.hpp"

#include "models.hpp"
#include "random_tensors.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// A layer with random numbers; lengths are those of rows and of columns.
struct Deformable {
  cv::Mat image, offsets, weights, kernels, biases;
  cv::Size stride, dilation;
  int top, left, bottom, right, groups;

  cv::Size size() const {
    const auto length = [](int image, int pads, int kernel, int dilation, int stride) {
      return (image + pads - dilation * (kernel - 1) - 1) / stride + 1;
    };
    return {length(image.size[3], left + right, kernels.size[3], dilation.width, stride.width),
            length(image.size[2], top + bottom, kernels.size[2], dilation.height, stride.height)};
  }

  static double value(const cv::Mat& tensor, int n, int c, int y, int x) {
    return double{tensor.at<float>(cv::Vec4i(n, c, y, x))};
  }

  /// Oracle: one output, as the paper defines it, over all pixels of the image.
  double naive(int n, int m, int row, int column) const {
    const int height = kernels.size[2], width = kernels.size[3], size = height * width;
    double sum = biases.empty() ? 0 : double{biases.at<float>(m)};
    for (int c = 0; c < image.size[1]; ++c) {
      const int group = c * groups / image.size[1];
      for (int k = 0; k < size; ++k) {
        const int i = group * size + k;
        const double y = row * stride.height - top + k / width * dilation.height +
                         value(offsets, n, 2 * i, row, column);
        const double x = column * stride.width - left + k % width * dilation.width +
                         value(offsets, n, 2 * i + 1, row, column);
        double read = 0;
        for (int v = 0; v < image.size[2]; ++v) {
          for (int u = 0; u < image.size[3]; ++u) {
            read += std::max(0.0, 1 - std::abs(y - v)) * std::max(0.0, 1 - std::abs(x - u)) *
                    value(image, n, c, v, u);
          }
        }
        const double weight = weights.empty() ? 1 : value(weights, n, i, row, column);
        sum += read * weight * value(kernels, m, c, k / width, k % width);
      }
    }
    return sum;
  }
};

Deformable random_layer(std::mt19937& random, bool has_weights, bool has_biases) {
  const auto between = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  Deformable layer;
  layer.groups = between(1, 2);
  layer.stride = {between(1, 3), between(1, 2)};
  layer.dilation = {between(1, 2), between(1, 3)};
  layer.top = between(0, 2);
  layer.left = between(0, 2);
  layer.bottom = between(0, 2);
  layer.right = between(0, 2);
  const int batch = between(1, 2), channels = 2 * between(1, 2), count = between(1, 3);
  const std::vector<int> kernel = {count, channels, between(1, 3), between(1, 3)};
  layer.image = random_tensor(random, {batch, channels, between(7, 10), between(7, 10)}, -2, 2);
  layer.kernels = random_tensor(random, kernel, -1, 1);
  const cv::Size size = layer.size();
  const int places = layer.groups * kernel[2] * kernel[3];
  layer.offsets = random_tensor(random, {batch, 2 * places, size.height, size.width}, -4, 4);
  if (has_weights) {
    layer.weights = random_tensor(random, {batch, places, size.height, size.width}, 0, 1);
  }
  if (has_biases) layer.biases = random_tensor(random, {count}, -1, 1);
  return layer;
}

cv::dnn::LayerParams parameters_of(const Deformable& layer) {
  cv::dnn::LayerParams params;
  const auto set = [&](const char* name, std::initializer_list<int> numbers) {
    params.set(name, cv::dnn::DictValue::arrayInt(numbers.begin(), int(numbers.size())));
  };
  set("stride", {layer.stride.height, layer.stride.width});
  set("dilation", {layer.dilation.height, layer.dilation.width});
  set("pad", {layer.top, layer.left, layer.bottom, layer.right});
  params.set("deform_groups", layer.groups);
  params.blobs = {layer.kernels};
  if (!layer.biases.empty()) params.blobs.push_back(layer.biases);
  return params;
}

TEST(DeformableConvolution, MatchesTheOracle) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE(trial);
    const Deformable made = random_layer(random, trial % 3 != 0, trial % 2 == 0);
    cv::dnn::LayerParams params = parameters_of(made);
    const cv::Ptr<cv::dnn::Layer> layer = detail::make_deformable_convolution(params);
    std::vector<cv::Mat> inputs = {made.image, made.offsets}, outputs, none;
    if (!made.weights.empty()) inputs.push_back(made.weights);
    std::vector<cv::dnn::MatShape> shapes, results, internals;
    for (const cv::Mat& input : inputs)
      shapes.push_back(cv::dnn::MatShape(input.size.p, input.size.p + input.dims));
    layer->getMemoryShapes(shapes, 1, results, internals);
    const cv::Size size = made.size();
    ASSERT_EQ(results[0], (cv::dnn::MatShape{made.image.size[0], made.kernels.size[0], size.height,
                                             size.width}));
    outputs.push_back(tensor(results[0]));
    layer->forward(inputs, outputs, none);
    for (int n = 0; n < results[0][0]; ++n) {
      for (int m = 0; m < results[0][1]; ++m) {
        for (int y = 0; y < size.height; ++y) {
          for (int x = 0; x < size.width; ++x) {
            ASSERT_NEAR(Deformable::value(outputs[0], n, m, y, x), made.naive(n, m, y, x), 2e-5)
                << n << ' ' << m << ' ' << y << ' ' << x;
          }
        }
      }
    }
  }
}

TEST(DeformableConvolution, ReadsZeroWhereOffsetsAreNoPlace) {
  cv::dnn::LayerParams params;
  params.blobs = {tensor({1, 1, 1, 1}, 1)};
  const auto layer = detail::make_deformable_convolution(params);
  for (const float offset : {NAN, INFINITY, -INFINITY, 1e30F, -1e30F, -1.0F, 3.0F}) {
    std::vector<cv::Mat> inputs = {tensor({1, 1, 3, 3}, 5), tensor({1, 2, 3, 3}, 0)};
    inputs[1].at<float>(cv::Vec4i(0, 1, 0, 0)) = offset;  // to the right
    std::vector<cv::Mat> outputs = {tensor({1, 1, 3, 3})}, none;
    layer->forward(inputs, outputs, none);
    EXPECT_EQ(Deformable::value(outputs[0], 0, 0, 0, 0), 0) << offset;
    EXPECT_EQ(Deformable::value(outputs[0], 0, 0, 1, 1), 5) << offset;
  }
}

TEST(DeformableConvolution, RefusesWhatDoesNotFit) {
  const auto make = [](const auto& change) {
    cv::dnn::LayerParams params;
    params.blobs = {tensor({2, 4, 3, 3})};
    change(params);
    return detail::make_deformable_convolution(params);
  };
  EXPECT_THROW(make([](auto& params) { params.blobs.clear(); }), cv::Exception);
  EXPECT_THROW(make([](auto& params) { params.blobs.push_back(tensor({3})); }), cv::Exception);
  EXPECT_THROW(make([](auto& params) { params.set("group", 2); }), cv::Exception);
  EXPECT_THROW(make([](auto& params) { params.set("deform_groups", 3); }), cv::Exception);
  EXPECT_THROW(make([](auto& params) { params.set("stride", 0); }), cv::Exception);
  EXPECT_THROW(make([](auto& params) { params.set("dilation", 1 << 30); }), cv::Exception);
  const auto layer = make([](auto&) {});
  std::vector<cv::dnn::MatShape> outputs, internals;
  const auto takes = [&](const std::vector<cv::dnn::MatShape>& inputs) {
    layer->getMemoryShapes(inputs, 1, outputs, internals);
  };
  takes({{1, 4, 5, 6}, {1, 18, 3, 4}, {1, 9, 3, 4}});
  EXPECT_EQ(outputs[0], (cv::dnn::MatShape{1, 2, 3, 4}));
  EXPECT_THROW(takes({{1, 3, 5, 6}, {1, 18, 3, 4}, {1, 9, 3, 4}}), cv::Exception);
  EXPECT_THROW(takes({{1, 4, 5, 6}, {1, 9, 3, 4}, {1, 18, 3, 4}}), cv::Exception);
  EXPECT_THROW(takes({{1, 4, 5, 6}, {1, 18, 3, 4}, {1, 9, 4, 4}}), cv::Exception);
  EXPECT_THROW(takes({{1, 4, 2, 6}, {1, 18, 0, 4}, {1, 9, 0, 4}}), cv::Exception);
  EXPECT_THROW(takes({{1, 4, 5, 6}}), cv::Exception);
}

}  // namespace
}  // namespace dynfilter::testing
