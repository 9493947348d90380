// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A model in OpenCV's dnn module; its errors name the file.

#ifndef DYNFILTER_SRC_NETWORKS_NETWORK_HPP
#define DYNFILTER_SRC_NETWORKS_NETWORK_HPP

#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>

#include "onnx_file.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

class Network {
 public:
  /// Loads the model; `size_where_open` is the size of the input if the file leaves it open (0x0:
  /// the file must say it). Throws std::runtime_error that names the file.
  Network(const std::filesystem::path& path, const cv::Size& size_where_open);

  const std::filesystem::path& path() const { return path_; }
  const cv::Size& input_size() const { return input_size_; }
  const std::map<std::string, std::string>& metadata() const { return file_.metadata; }

  /// Returns the outputs for an input [1, 3, rows, columns], in the order of the file, constant
  /// ones included. They are valid until the next call. Throws std::runtime_error that names the
  /// file.
  std::vector<NamedTensor> forward(const cv::Mat& input);

  /// Throws a std::runtime_error that names the file.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  /// Throws a std::runtime_error for an error of OpenCV; the message adds advice.
  [[noreturn]] void fail_in_opencv(const std::exception& error) const;

  std::filesystem::path path_;
  OnnxFile file_;
  cv::Size input_size_;
  cv::dnn::Net net_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_NETWORK_HPP
