// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Outputs of a network, whichever way exporters arrange rows and columns.

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// One output: CV_32F, continuous, of any number of dimensions.
struct NamedTensor {
  std::string name;
  cv::Mat data;
};

inline std::vector<int> shape_of(const cv::Mat& tensor) {
  return {tensor.size.p, tensor.size.p + tensor.dims};
}

/// Formats a shape: "[1, 32, 160, 160]".
inline std::string shape_text(const std::vector<int>& shape) {
  std::string text = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(shape[i]);
  }
  return text + "]";
}

/// Formats all shapes: "loc [1, 19248, 4], proto [1, 138, 138, 32]".
inline std::string shapes_text(const std::vector<NamedTensor>& tensors) {
  std::string text;
  for (const NamedTensor& tensor : tensors) {
    text += (text.empty() ? "" : ", ") + tensor.name + ' ' + shape_text(shape_of(tensor.data));
  }
  return text;
}

using Table = cv::Mat_<float>;

/// Returns a tensor's numbers in so many rows and columns, without a copy.
inline Table as_table(const cv::Mat& tensor, int rows, int columns) {
  const std::array<int, 2> shape = {rows, columns};
  return tensor.reshape(1, 2, shape.data());
}

/// Returns the table of a tensor [1, rows, columns] or [rows, columns], without a copy.
inline Table rows_first(const cv::Mat& tensor) {
  return as_table(tensor, tensor.size[tensor.dims - 2], tensor.size[tensor.dims - 1]);
}

/// Returns a row of a table; empty if a number in it is not finite.
inline std::vector<float> finite_row(const Table& table, int row) {
  if (!cv::checkRange(table.row(row))) return {};
  return table.row(row);
}

/// Planes of numbers: mask prototypes, or scores of classes.
struct Planes {
  cv::Mat tensor;
  int count = 0, rows = 0, columns = 0;
  bool is_count_last = false;

  /// Returns a row for each plane, of rows x columns cells; copies if the count is last.
  Table cells() const {
    if (!is_count_last) return as_table(tensor, count, rows * columns);
    return cv::Mat(as_table(tensor, rows * columns, count).t());
  }

  /// Whether the planes have the aspect ratio of an image, to less than a cell.
  bool has_aspect_of(const cv::Size& image) const {
    const std::int64_t difference =
        std::int64_t{rows} * image.width - std::int64_t{columns} * image.height;
    return std::abs(difference) < std::max(image.width, image.height);
  }
};

/// Views a tensor [1, count, rows, columns].
inline Planes count_first(const cv::Mat& tensor) {
  return {tensor, tensor.size[1], tensor.size[2], tensor.size[3], false};
}

/// Views a tensor [1, rows, columns, count].
inline Planes count_last(const cv::Mat& tensor) {
  return {tensor, tensor.size[3], tensor.size[1], tensor.size[2], true};
}

inline float sigmoid(float value) { return 1.0F / (1.0F + std::exp(-value)); }

}  // namespace dynfilter::detail
