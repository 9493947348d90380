// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Times deformable convolution beside OpenCV's ordinary one, at YOLACT++'s sizes for an image of
// 550x550. The arguments are input and output channels, and the side of the feature map.

#include <random>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/dnn/all_layers.hpp>

#include "networks/deformable_convolution.hpp"

namespace {

cv::Mat random_tensor(const std::vector<int>& shape, float reach) {
  cv::Mat data(static_cast<int>(shape.size()), shape.data(), CV_32F);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> number(-reach, reach);
  for (std::size_t i = 0; i < data.total(); ++i) data.ptr<float>()[i] = number(random);
  return data;
}

void deformable(benchmark::State& state, int outputs) {
  const int channels = static_cast<int>(state.range(0));
  const int side = static_cast<int>(state.range(1));
  dynfilter::detail::DeformableConvolutionOptions options;
  options.pad_top = options.pad_left = options.pad_bottom = options.pad_right = 1;
  dynfilter::detail::DeformableConvolution convolution(random_tensor({outputs, channels, 3, 3}, 1),
                                                       cv::Mat(), options);
  const cv::Mat input = random_tensor({1, channels, side, side}, 1);
  const cv::Mat offsets = random_tensor({1, 18, side, side}, 2);
  const cv::Mat mask = random_tensor({1, 9, side, side}, 1);
  cv::Mat output;
  for (auto _ : state) convolution.apply(input, offsets, mask, output);
}

void deformable_convolution(benchmark::State& state) {
  deformable(state, static_cast<int>(state.range(0)));
}

/// Times one output channel: almost only the sampling.
void sampling(benchmark::State& state) { deformable(state, 1); }

void ordinary_convolution(benchmark::State& state) {
  const int channels = static_cast<int>(state.range(0));
  const int side = static_cast<int>(state.range(1));
  cv::dnn::LayerParams params;
  params.set("kernel_size", 3);
  params.set("pad", 1);
  params.set("num_output", channels);
  params.set("bias_term", false);
  params.blobs.push_back(random_tensor({channels, channels, 3, 3}, 1));
  const cv::Ptr<cv::dnn::Layer> layer = cv::dnn::ConvolutionLayer::create(params);
  const std::vector<cv::Mat> inputs = {random_tensor({1, channels, side, side}, 1)};
  std::vector<cv::Mat> outputs = {random_tensor({1, channels, side, side}, 1)};
  std::vector<cv::Mat> internals;
  layer->finalize(cv::InputArrayOfArrays(inputs), cv::OutputArrayOfArrays(outputs));
  for (auto _ : state) layer->forward(inputs, outputs, internals);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({128, 69})->Args({256, 35})->Args({512, 18});
  benchmark->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK(deformable_convolution)->Apply(sizes);
BENCHMARK(sampling)->Apply(sizes);
BENCHMARK(ordinary_convolution)->Apply(sizes);

}  // namespace
