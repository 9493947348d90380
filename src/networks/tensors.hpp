// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Outputs of a network, and views that hide how exporters arrange rows and columns.

#ifndef DYNFILTER_SRC_NETWORKS_TENSORS_HPP
#define DYNFILTER_SRC_NETWORKS_TENSORS_HPP

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
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

/// Tells whether the tensor's name contains one of these words, ignoring case.
inline bool is_named(const NamedTensor& tensor, std::initializer_list<std::string_view> words) {
  std::string name = tensor.name;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return name.find(word) != std::string::npos; });
}

/// A table of numbers with any strides. A view: it does not own the tensor.
struct Table {
  const float* data = nullptr;
  int rows = 0;
  int columns = 0;
  std::size_t row_step = 0;  // in floats
  std::size_t column_step = 1;

  float at(int row, int column) const {
    return data[static_cast<std::size_t>(row) * row_step +
                static_cast<std::size_t>(column) * column_step];
  }

  /// Returns `count` columns from `first` on. A tensor of 0 rows has no data to point into.
  Table part(int first, int count) const {
    const float* const begin =
        data == nullptr ? nullptr : data + static_cast<std::size_t>(first) * column_step;
    return {begin, rows, count, row_step, column_step};
  }
};

/// Returns a row of a table; empty if a number in it is not finite.
inline std::vector<float> finite_row(const Table& table, int row) {
  std::vector<float> numbers(static_cast<std::size_t>(table.columns));
  for (int k = 0; k < table.columns; ++k) {
    numbers[static_cast<std::size_t>(k)] = table.at(row, k);
    if (!std::isfinite(table.at(row, k))) return {};
  }
  return numbers;
}

/// Views a tensor [1, rows, columns] or [rows, columns].
inline Table rows_first(const cv::Mat& tensor) {
  const int rows = tensor.size[tensor.dims - 2];
  const int columns = tensor.size[tensor.dims - 1];
  return {tensor.ptr<float>(), rows, columns, static_cast<std::size_t>(columns), 1};
}

/// Views a tensor [1, columns, rows].
inline Table columns_first(const cv::Mat& tensor) {
  const Table turned = rows_first(tensor);
  return {turned.data, turned.columns, turned.rows, 1, turned.row_step};
}

/// The mask prototypes: `count` images of rows x columns numbers.
struct Prototypes {
  const float* data = nullptr;
  int count = 0;
  int rows = 0;
  int columns = 0;
  std::size_t prototype_step = 0;  // in floats
  std::size_t cell_step = 1;
};

/// Views a tensor [1, count, rows, columns].
inline Prototypes prototypes_first(const cv::Mat& tensor) {
  const int rows = tensor.size[2];
  const int columns = tensor.size[3];
  return {tensor.ptr<float>(),
          tensor.size[1],
          rows,
          columns,
          static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns),
          1};
}

/// Views a tensor [1, rows, columns, count].
inline Prototypes prototypes_last(const cv::Mat& tensor) {
  return {tensor.ptr<float>(),
          tensor.size[3],
          tensor.size[1],
          tensor.size[2],
          1,
          static_cast<std::size_t>(tensor.size[3])};
}

inline float sigmoid(float value) { return 1.0F / (1.0F + std::exp(-value)); }

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_TENSORS_HPP
