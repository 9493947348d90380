// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A model in OpenCV's dnn module, whose errors name the file.

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
  /// Loads it, for input of this size where the file leaves it open (0x0 = the file must say it).
  /// Throws std::runtime_error that names the file.
  Network(const std::filesystem::path& path, const cv::Size& size_where_open);

  const std::filesystem::path& path() const { return path_; }
  const cv::Size& input_size() const { return input_size_; }
  const std::map<std::string, std::string>& metadata() const { return file_.metadata; }

  /// The outputs for an input [1, 3, rows, columns], in the order of the file, constant ones too.
  /// They live until the next call. Throws std::runtime_error that names the file.
  std::vector<NamedTensor> forward(const cv::Mat& input);

  /// Throws a std::runtime_error in the name of the file.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  /// The same for what was thrown in OpenCV, with what would help.
  [[noreturn]] void fail_in_opencv(const std::exception& error) const;

  std::filesystem::path path_;
  OnnxFile file_;
  cv::Size input_size_;
  cv::dnn::Net net_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_NETWORK_HPP
