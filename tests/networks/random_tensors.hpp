// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tensors for tests of decoders, hand-made and random.

#pragma once

#include <random>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "networks/tensors.hpp"

namespace dynfilter::testing {

inline cv::Mat tensor(const std::vector<int>& shape, float value = 0) {
  cv::Mat data(static_cast<int>(shape.size()), shape.data(), CV_32F);
  data = cv::Scalar(double{value});
  return data;
}

/// Tensor of uniform random numbers.
template <class Random>
cv::Mat random_tensor(Random& random, const std::vector<int>& shape, float low, float high) {
  cv::Mat data = tensor(shape);
  std::uniform_real_distribution<float> number(low, high);
  float* values = data.ptr<float>();
  for (std::size_t i = 0; i < data.total(); ++i) values[i] = number(random);
  return data;
}

/// Transposes [1, a, b] to [1, b, a].
inline cv::Mat turned(const cv::Mat& data) {
  cv::Mat result = tensor({1, data.size[2], data.size[1]});
  for (int i = 0; i < data.size[1]; ++i) {
    for (int j = 0; j < data.size[2]; ++j) result.at<float>(0, j, i) = data.at<float>(0, i, j);
  }
  return result;
}

/// Transposes [1, count, rows, columns] to [1, rows, columns, count].
inline cv::Mat count_last(const cv::Mat& data) {
  cv::Mat result = tensor({1, data.size[2], data.size[3], data.size[1]});
  for (int k = 0; k < data.size[1]; ++k) {
    for (int y = 0; y < data.size[2]; ++y) {
      for (int x = 0; x < data.size[3]; ++x) {
        result.at<float>(cv::Vec4i(0, y, x, k)) = data.at<float>(cv::Vec4i(0, k, y, x));
      }
    }
  }
  return result;
}

}  // namespace dynfilter::testing
