// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Facts that an ONNX file holds besides its layers: its inputs and outputs, their shapes and order,
// constant outputs, the exporter's metadata, and whether the file is whole. OpenCV 4.6 reports none
// of this, drops constant outputs, and fails on a broken file with unrelated messages.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// An input or output of the graph. A dimension that the file leaves open is 0.
struct OnnxValue {
  std::string name;
  std::vector<int> shape;
};

struct OnnxFile {
  std::vector<char> bytes;                      ///< the whole file
  std::vector<OnnxValue> inputs;                ///< without those that have a constant value
  std::vector<OnnxValue> outputs;               ///< in the order of the file
  std::map<std::string, cv::Mat> constants;     ///< outputs with a value in the file; CV_32FC1
  std::map<std::string, std::string> metadata;  ///< key and value, as exporters write them
};

/// Reads a model. Throws std::runtime_error that names the file for one that is missing, truncated
/// or no ONNX model, and for one whose weights lie in another file.
OnnxFile read_onnx_file(const std::filesystem::path& path);

}  // namespace dynfilter::detail
