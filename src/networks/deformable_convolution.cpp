// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "deformable_convolution.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {
namespace {

/// Returns the first parameter that is there, as numbers of rows and of columns, before and after.
cv::Vec4i parameter(const cv::dnn::LayerParams& params, std::initializer_list<const char*> names,
                    int usual) {
  for (const char* name : names) {
    if (!params.has(name)) continue;
    const cv::dnn::DictValue value = params.get(name);
    CV_Assert(value.size() == 1 || value.size() == 2 || value.size() == 4);
    cv::Vec4i numbers;
    for (int i = 0; i < 4; ++i) numbers[i] = value.get<int>(i % value.size());
    CV_Assert(cv::checkRange(numbers, true, nullptr, -4096, 4096));  // so that nothing overflows
    return numbers;
  }
  return cv::Vec4i::all(usual);
}

/// Reads a plane between its pixels; 0 outside.
float interpolated(const float* plane, int rows, int columns, float y, float x) {
  const bool is_near = y > -1 && x > -1 && y < float(rows) && x < float(columns);
  if (!is_near) return 0;  // as is what is not a number
  const int top = cvFloor(y), left = cvFloor(x);
  float sum = 0;
  for (int row = std::max(top, 0); row <= std::min(top + 1, rows - 1); ++row) {
    for (int column = std::max(left, 0); column <= std::min(left + 1, columns - 1); ++column) {
      const float weight = (1 - std::abs(y - float(row))) * (1 - std::abs(x - float(column)));
      sum += weight * plane[std::ptrdiff_t{row} * columns + column];
    }
  }
  return sum;
}

class DeformableConvolution final : public cv::dnn::Layer {
 public:
  explicit DeformableConvolution(const cv::dnn::LayerParams& params)
      : Layer(params),
        stride_(parameter(params, {"stride"}, 1)),
        pad_(parameter(params, {"pad", "padding"}, 0)),
        dilation_(parameter(params, {"dilation"}, 1)),
        groups_(parameter(params, {"offset_group", "deform_groups", "deformable_group"}, 1)[0]) {
    CV_Assert(parameter(params, {"group", "groups"}, 1)[0] == 1 && !blobs.empty());
    CV_Assert(blobs[0].dims == 4 && blobs[0].type() == CV_32F);
    CV_Assert(groups_ > 0 && blobs[0].size[1] % groups_ == 0);
    CV_Assert(stride_[0] > 0 && stride_[1] > 0 && dilation_[0] > 0 && dilation_[1] > 0);
    CV_Assert(blobs.size() == 1 ||
              (blobs[1].type() == CV_32F && blobs[1].total() == std::size_t(blobs[0].size[0])));
  }

  bool getMemoryShapes(const std::vector<cv::dnn::MatShape>& inputs, int,
                       std::vector<cv::dnn::MatShape>& outputs,
                       std::vector<cv::dnn::MatShape>&) const override {
    CV_Assert(inputs.size() == 2 || inputs.size() == 3);
    cv::dnn::MatShape shape = inputs[0];
    CV_Assert(shape.size() == 4 && shape[1] == blobs[0].size[1]);
    for (int side = 0; side < 2; ++side) {
      int& length = shape[std::size_t(side) + 2];
      length += pad_[side] + pad_[side + 2] - dilation_[side] * (blobs[0].size[side + 2] - 1) - 1;
      CV_Assert(length >= 0);
      length = length / stride_[side] + 1;
    }
    shape[1] = groups_ * blobs[0].size[2] * blobs[0].size[3];
    CV_Assert(inputs.size() == 2 || inputs[2] == shape);
    shape[1] *= 2;
    CV_Assert(inputs[1] == shape);
    shape[1] = blobs[0].size[0];
    outputs = {shape};
    return false;
  }

  void forward(cv::InputArrayOfArrays in, cv::OutputArrayOfArrays out,
               cv::OutputArrayOfArrays) override {
    std::vector<cv::Mat> inputs, outputs;
    in.getMatVector(inputs);
    out.getMatVector(outputs);
    const cv::Mat kernels = blobs[0].reshape(1, blobs[0].size[0]);
    const int columns = outputs[0].size[3], places = outputs[0].size[2] * columns;
    for (int n = 0; n < inputs[0].size[0]; ++n) {
      cv::Mat sums(kernels.rows, places, CV_32F, outputs[0].ptr<float>(n));
      cv::gemm(kernels, pixels_of(inputs, n, places, columns), 1, cv::noArray(), 0, sums);
      for (int k = 0; blobs.size() > 1 && k < sums.rows; ++k) {
        sums.row(k) += blobs[1].ptr<float>()[k];
      }
    }
  }

 private:
  /// Reads the pixels for each output, of which `columns` make a row: a row a channel and kernel's
  /// pixel, a column an output.
  cv::Mat pixels_of(const std::vector<cv::Mat>& inputs, int n, int places, int columns) const {
    const cv::Mat& image = inputs[0];
    const int width = blobs[0].size[3], size = blobs[0].size[2] * width;
    cv::Mat pixels(image.size[1] * size, places, CV_32F);
    for (int row = 0; row < pixels.rows; ++row) {
      const int channel = row / size, pixel = row % size;
      const int i = channel / (image.size[1] / groups_) * size + pixel;
      const float* const dy = inputs[1].ptr<float>(n, 2 * i);
      const float* const dx = inputs[1].ptr<float>(n, 2 * i + 1);
      const float* const weights = inputs.size() > 2 ? inputs[2].ptr<float>(n, i) : nullptr;
      for (int k = 0; k < places; ++k) {
        const int y = k / columns * stride_[0] + pixel / width * dilation_[0] - pad_[0];
        const int x = k % columns * stride_[1] + pixel % width * dilation_[1] - pad_[1];
        pixels.at<float>(row, k) = (weights != nullptr ? weights[k] : 1) *
                                   interpolated(image.ptr<float>(n, channel), image.size[2],
                                                image.size[3], float(y) + dy[k], float(x) + dx[k]);
      }
    }
    return pixels;
  }

  cv::Vec4i stride_, pad_, dilation_;
  int groups_;
};

}  // namespace

cv::Ptr<cv::dnn::Layer> make_deformable_convolution(cv::dnn::LayerParams& params) {
  return cv::makePtr<DeformableConvolution>(params);
}

}  // namespace dynfilter::detail
