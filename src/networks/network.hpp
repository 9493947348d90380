// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A model in OpenCV's dnn module; its errors name the file.

#pragma once

#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>

#include "dynfilter/networks/network_segmenter.hpp"
#include "onnx_file.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// Most pixels of a network's input. Each takes 12 bytes, and some hundred in the layers.
constexpr int max_input_pixels = 1 << 24;

/// Tells whether a network may have such an input.
inline bool is_sane_input(const cv::Size& size) {
  return size.width > 0 && size.height > 0 && size.height <= max_input_pixels / size.width;
}

class Network {
 public:
  /// Loads the model for the device and, where the file leaves the size of its input open, for the
  /// size of the options. Throws std::runtime_error that names the file.
  Network(const std::filesystem::path& path, const NetworkOptions& options);

  const std::filesystem::path& path() const { return path_; }
  const cv::Size& input_size() const { return input_size_; }

  /// Returns what exporters write beside the layers; empty if there is no such entry.
  std::string metadata(const std::string& key) const;

  /// Returns the outputs for an input [1, 3, rows, columns], in the order of the file, constant
  /// ones included. They are valid until the next call. Throws std::runtime_error that names the
  /// file.
  std::vector<NamedTensor> forward(const cv::Mat& input);

  /// Throws a std::runtime_error that names the file.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  /// Throws a std::runtime_error for an error of OpenCV; the message adds advice.
  [[noreturn]] void fail_in_opencv(const std::exception& error) const;

  void find_input(const cv::Size& size_where_open);
  void use_device(const std::string& device);

  std::filesystem::path path_;
  OnnxFile file_;
  cv::Size input_size_;
  bool has_channels_last_ = false;  // the input is [1, rows, columns, 3]
  cv::dnn::Net net_;
};

/// Returns the numbers in a text such as "[640, 480]".
std::vector<double> numbers_in(std::string text);

}  // namespace dynfilter::detail
