// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "network.hpp"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <new>

#include <opencv2/core/version.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"

namespace dynfilter::detail {
namespace {

constexpr int color_channels = 3;

/// Returns the size of the only input.
cv::Size input_size_of(const OnnxFile& file, const std::filesystem::path& path,
                       const cv::Size& size_where_open) {
  if (file.inputs.size() != 1) {
    throw_file_error(path, concatenate("has ", file.inputs.size(), " inputs; want 1"));
  }
  const std::vector<int>& shape = file.inputs[0].shape;
  const bool is_color_image =
      shape.size() == 4 && shape[0] <= 1 && (shape[1] == color_channels || shape[1] == 0);
  if (!is_color_image) {
    throw_file_error(path, "its input " + file.inputs[0].name + " has the shape " +
                               shape_text(shape) + "; want [1, 3, rows, columns]");
  }
  const cv::Size size(shape[3], shape[2]);
  if (size.width == 0 || size.height == 0) {
    if (size_where_open.empty()) {
      throw_file_error(path,
                       "leaves the size of its input open: export it with a fixed size, or set "
                       "NetworkOptions::input_size (Python: input_size=(width, height))");
    }
    return size_where_open;
  }
  if (!size_where_open.empty() && size_where_open != size) {
    throw_file_error(path, "has an input of " + size_name(size) +
                               ", but NetworkOptions::input_size is " + size_name(size_where_open));
  }
  return size;
}

/// Tells whether the file may be YOLO as exported, which computes its boxes inside the network and
/// joins them with the rest in one output.
bool may_be_exported_yolo(const OnnxFile& file) {
  const auto has_output_of = [&](std::size_t dimensions) {
    return std::any_of(file.outputs.begin(), file.outputs.end(),
                       [&](const OnnxValue& output) { return output.shape.size() == dimensions; });
  };
  return file.outputs.size() == 2 && has_output_of(3) && has_output_of(4);
}

constexpr bool opencv_runs_exported_yolo = CV_VERSION_MAJOR > 4 ||
                                           (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7);

/// Puts OpenCV's message on one line.
std::string in_one_line(const std::string& message) {
  std::string line;
  for (const char letter : message) {
    const bool is_blank = letter == '\n' || letter == ' ';
    if (is_blank && (line.empty() || line.back() == ' ')) continue;
    line += is_blank ? ' ' : letter;
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

}  // namespace

Network::Network(const std::filesystem::path& path, const cv::Size& size_where_open)
    : path_(path),
      file_(read_onnx_file(path)),
      input_size_(input_size_of(file_, path, size_where_open)) {
  try {
    net_ = cv::dnn::readNetFromONNX(file_.bytes.data(), file_.bytes.size());
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail_in_opencv(error);
  }
  if (net_.empty()) fail("OpenCV makes an empty network of it");
  net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  file_.bytes = {};  // OpenCV has copied the weights
}

std::vector<NamedTensor> Network::forward(const cv::Mat& input) {
  std::vector<cv::String> names;
  for (const OnnxValue& output : file_.outputs) {
    if (file_.constants.count(output.name) == 0) names.push_back(output.name);
  }
  std::vector<cv::Mat> computed;
  try {
    net_.setInput(input);
    if (!names.empty()) net_.forward(computed, names);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail_in_opencv(error);
  }
  std::vector<NamedTensor> outputs;
  std::size_t next = 0;
  for (const OnnxValue& output : file_.outputs) {
    const auto constant = file_.constants.find(output.name);
    const cv::Mat data = constant != file_.constants.end() ? constant->second : computed.at(next++);
    if (data.empty() || data.type() != CV_32FC1 || !data.isContinuous()) {
      fail("its output " + output.name + " is no tensor of floats");
    }
    outputs.push_back({output.name, data});
  }
  return outputs;
}

void Network::fail(const std::string& what) const { throw_file_error(path_, what); }

void Network::fail_in_opencv(const std::exception& error) const {
  std::string what = "OpenCV " CV_VERSION " cannot run it";
  if (!opencv_runs_exported_yolo && may_be_exported_yolo(file_)) {
    what +=
        ": YOLO as exported needs OpenCV 4.7 or newer; examples/cut_yolo_heads.py makes a model of "
        "it "
        "that runs here";
  }
  const auto* opencv_error = dynamic_cast<const cv::Exception*>(&error);
  fail(what + ": " + in_one_line(opencv_error != nullptr ? opencv_error->err : error.what()));
}

}  // namespace dynfilter::detail
