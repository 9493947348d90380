// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "deformable_convolution.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <opencv2/core/utility.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/dnn/all_layers.hpp>

#include "dynfilter/detail/errors.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {
namespace {

constexpr const char* name = "DeformableConvolution";

void require(bool is_kept, const std::string& got, const std::string& want) {
  if (!is_kept) throw_misuse(name, got, want);
}

std::string described(const cv::Mat& tensor) {
  return type_name(tensor) + ' ' + shape_text(shape_of(tensor));
}

void require_floats(const cv::Mat& tensor, const char* what) {
  require(tensor.dims == 4 && tensor.type() == CV_32FC1 && tensor.isContinuous(),
          std::string(what) + ' ' + described(tensor), "continuous CV_32FC1 of four dimensions");
}

void require_shape(const cv::Mat& tensor, const std::vector<int>& shape, const char* what) {
  require_floats(tensor, what);
  require(shape_of(tensor) == shape, std::string(what) + ' ' + described(tensor),
          shape_text(shape));
}

void require_valid(const DeformableConvolutionOptions& options) {
  const auto is_positive = [](const cv::Size& size) { return size.width > 0 && size.height > 0; };
  require(is_positive(options.stride) && is_positive(options.dilation),
          "stride " + size_name(options.stride) + ", dilation " + size_name(options.dilation),
          "at least 1x1");
  for (const int pad : {options.pad_top, options.pad_left, options.pad_bottom, options.pad_right}) {
    require(pad >= 0, concatenate("a padding of ", pad), "at least 0");
  }
  require(options.groups > 0 && options.offset_groups > 0,
          concatenate("groups ", options.groups, ", offset_groups ", options.offset_groups),
          "at least 1");
}

/// The place where a tap reads: four pixels of a channel and their weights. A pixel outside the
/// input has weight 0, and its index points to one inside.
struct Sample {
  std::array<int, 4> pixels;
  std::array<float, 4> weights;
};

Sample sample_at(float y, float x, float factor, const cv::Size& size) {
  Sample sample{};
  const bool is_close =
      y > -1 && x > -1 && y < static_cast<float>(size.height) && x < static_cast<float>(size.width);
  if (!is_close) return sample;  // NaN too
  const float floor_y = std::floor(y);
  const float floor_x = std::floor(x);
  const std::array<float, 2> weights_y = {1 - (y - floor_y), y - floor_y};
  const std::array<float, 2> weights_x = {1 - (x - floor_x), x - floor_x};
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const int row = static_cast<int>(floor_y) + static_cast<int>(corner / 2);
    const int column = static_cast<int>(floor_x) + static_cast<int>(corner % 2);
    if (row < 0 || column < 0 || row >= size.height || column >= size.width) continue;
    sample.pixels[corner] = row * size.width + column;
    sample.weights[corner] = weights_y[corner / 2] * weights_x[corner % 2] * factor;
  }
  return sample;
}

}  // namespace

struct DeformableConvolution::Parts {
  DeformableConvolutionOptions options;
  int outputs, inputs, taps_y, taps_x;
  // Multiplying weights by columns is a convolution of one tap with inputs x taps channels.
  // OpenCV's is blocked and threaded, and picks its instructions at run time.
  cv::Ptr<cv::dnn::Layer> product;
  std::vector<int> product_shape;  // shape of the columns that it is prepared for
  cv::Mat columns;

  int taps() const { return taps_y * taps_x; }

  /// Fills the columns of one image: row c · taps + k is for input channel c and tap k.
  void sample(const float* input, const cv::Size& input_size, const float* offsets,
              const float* mask, const cv::Size& output_size);

 private:
  void sample_row(const float* input, const cv::Size& input_size, const float* offsets,
                  const float* mask, const cv::Size& output_size, int offset_group, int row,
                  std::vector<Sample>& samples);
};

DeformableConvolution::DeformableConvolution(const cv::Mat& weights, const cv::Mat& bias,
                                             const DeformableConvolutionOptions& options)
    : parts_(std::make_unique<Parts>()) {
  require_valid(options);
  require_floats(weights, "weights");
  Parts& parts = *parts_;
  parts.options = options;
  parts.outputs = weights.size[0];
  parts.inputs = weights.size[1] * options.groups;
  parts.taps_y = weights.size[2];
  parts.taps_x = weights.size[3];
  require(parts.outputs % options.groups == 0 && parts.inputs % options.offset_groups == 0,
          concatenate(parts.outputs, " outputs in ", options.groups, " groups and ", parts.inputs,
                      " inputs in ", options.offset_groups, " offset groups"),
          "groups of one size");
  require(bias.empty() || (bias.type() == CV_32FC1 && bias.isContinuous() &&
                           bias.total() == static_cast<std::size_t>(parts.outputs)),
          bias.empty() ? "" : "bias " + described(bias),
          concatenate(parts.outputs, " continuous numbers, CV_32FC1"));

  cv::dnn::LayerParams params;
  params.name = name;
  params.type = "Convolution";
  params.set("kernel_size", 1);
  params.set("num_output", parts.outputs);
  params.set("group", options.groups);
  params.set("bias_term", !bias.empty());
  const std::array<int, 4> shape = {parts.outputs, weights.size[1] * parts.taps(), 1, 1};
  params.blobs.push_back(weights.reshape(1, static_cast<int>(shape.size()), shape.data()).clone());
  if (!bias.empty()) params.blobs.push_back(bias.reshape(1, 1).clone());
  parts.product = cv::dnn::ConvolutionLayer::create(params);
}

DeformableConvolution::DeformableConvolution(DeformableConvolution&&) noexcept = default;
DeformableConvolution& DeformableConvolution::operator=(DeformableConvolution&&) noexcept = default;
DeformableConvolution::~DeformableConvolution() = default;

cv::Size DeformableConvolution::output_size(const cv::Size& input) const {
  const DeformableConvolutionOptions& options = parts_->options;
  const auto steps = [](int length, int taps, int dilation, int stride) {
    const int room = length - (taps - 1) * dilation - 1;
    return room < 0 ? 0 : room / stride + 1;
  };
  return {steps(input.width + options.pad_left + options.pad_right, parts_->taps_x,
                options.dilation.width, options.stride.width),
          steps(input.height + options.pad_top + options.pad_bottom, parts_->taps_y,
                options.dilation.height, options.stride.height)};
}

void DeformableConvolution::Parts::sample(const float* input, const cv::Size& input_size,
                                          const float* offsets, const float* mask,
                                          const cv::Size& output_size) {
  const int rows = options.offset_groups * output_size.height;
  cv::parallel_for_(cv::Range(0, rows), [&](const cv::Range& range) {
    std::vector<Sample> samples(static_cast<std::size_t>(taps() * output_size.width));
    for (int i = range.start; i < range.end; ++i) {
      sample_row(input, input_size, offsets, mask, output_size, i / output_size.height,
                 i % output_size.height, samples);
    }
  });
}

void DeformableConvolution::Parts::sample_row(const float* input, const cv::Size& input_size,
                                              const float* offsets, const float* mask,
                                              const cv::Size& output_size, int offset_group,
                                              int row, std::vector<Sample>& samples) {
  const auto plane = static_cast<std::size_t>(output_size.area());
  const std::size_t first =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(output_size.width);
  std::size_t i = 0;
  for (int tap = 0; tap < taps(); ++tap) {
    const auto map = static_cast<std::size_t>(offset_group * taps() + tap);
    const float* moved_y = offsets + 2 * map * plane + first;
    const float* moved_x = moved_y + plane;
    const float* factor = mask != nullptr ? mask + map * plane + first : nullptr;
    const int y =
        row * options.stride.height - options.pad_top + tap / taps_x * options.dilation.height;
    const int first_x = tap % taps_x * options.dilation.width - options.pad_left;
    for (int x = 0; x < output_size.width; ++x, ++i) {
      samples[i] = sample_at(static_cast<float>(y) + moved_y[x],
                             static_cast<float>(first_x + x * options.stride.width) + moved_x[x],
                             factor != nullptr ? factor[x] : 1.0F, input_size);
    }
  }
  const int channels = inputs / options.offset_groups;
  for (int c = offset_group * channels; c < (offset_group + 1) * channels; ++c) {
    const float* channel =
        input + static_cast<std::size_t>(c) * static_cast<std::size_t>(input_size.area());
    const Sample* sample = samples.data();
    for (int tap = 0; tap < taps(); ++tap) {
      float* column = columns.ptr<float>(0, c * taps() + tap) + first;
      for (int x = 0; x < output_size.width; ++x, ++sample) {
        column[x] = sample->weights[0] * channel[sample->pixels[0]] +
                    sample->weights[1] * channel[sample->pixels[1]] +
                    sample->weights[2] * channel[sample->pixels[2]] +
                    sample->weights[3] * channel[sample->pixels[3]];
      }
    }
  }
}

void DeformableConvolution::apply(const cv::Mat& input, const cv::Mat& offsets, const cv::Mat& mask,
                                  cv::Mat& output) {
  Parts& parts = *parts_;
  require_floats(input, "input");
  const int batch = input.size[0];
  require(input.size[1] == parts.inputs, "input " + described(input),
          concatenate(parts.inputs, " channels"));
  const cv::Size input_size(input.size[3], input.size[2]);
  const cv::Size size = output_size(input_size);
  require(!size.empty(), "input " + described(input), "at least the size of the kernel");
  const int maps = parts.options.offset_groups * parts.taps();
  require_shape(offsets, {batch, 2 * maps, size.height, size.width}, "offsets");
  if (!mask.empty()) require_shape(mask, {batch, maps, size.height, size.width}, "mask");

  const std::vector<int> columns_shape = {1, parts.inputs * parts.taps(), size.height, size.width};
  const std::vector<int> output_shape = {batch, parts.outputs, size.height, size.width};
  // Swaps the result into the output at the end, because input and output may be one matrix.
  const bool is_in_place =
      output.data != nullptr &&
      (output.data == input.data || output.data == offsets.data || output.data == mask.data);
  const bool fits =
      output.type() == CV_32FC1 && output.isContinuous() && shape_of(output) == output_shape;
  cv::Mat result = fits && !is_in_place ? output : cv::Mat(4, output_shape.data(), CV_32F);
  parts.columns.create(4, columns_shape.data(), CV_32F);
  for (int n = 0; n < batch; ++n) {
    parts.sample(input.ptr<float>(n), input_size, offsets.ptr<float>(n),
                 mask.empty() ? nullptr : mask.ptr<float>(n), size);
    const std::array<int, 4> image_shape = {1, parts.outputs, size.height, size.width};
    std::vector<cv::Mat> images = {cv::Mat(4, image_shape.data(), CV_32F, result.ptr<float>(n))};
    const std::vector<cv::Mat> columns = {parts.columns};
    std::vector<cv::Mat> internals;
    if (parts.product_shape != columns_shape) {
      parts.product->finalize(cv::InputArrayOfArrays(columns), cv::OutputArrayOfArrays(images));
      parts.product_shape = columns_shape;
    }
    parts.product->forward(columns, images, internals);
  }
  output = result;
}

}  // namespace dynfilter::detail
