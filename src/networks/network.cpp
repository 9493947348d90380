// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "network.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <iterator>
#include <locale>
#include <memory>
#include <mutex>
#include <new>
#include <sstream>

#include <opencv2/core/version.hpp>
#include <opencv2/dnn/layer.hpp>

#include "deformable_convolution.hpp"
#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"

namespace dynfilter::detail {
namespace {

/// Returns an image [1, 3, rows, columns] as [1, rows, columns, 3].
cv::Mat channels_last(cv::Mat tensor) {
  const std::array<int, 4> shape = {1, tensor.size[2], tensor.size[3], 3};
  const cv::Mat pixels = as_table(tensor, 3, shape[1] * shape[2]).t();
  return pixels.reshape(1, 4, shape.data());
}

/// Tells whether the file may be YOLO as exported, which computes its boxes inside the network and
/// joins them with the rest in one output; a detector has no other.
bool may_be_exported_yolo(const OnnxFile& file) {
  const auto has_output_of = [&](std::size_t dimensions) {
    return std::any_of(file.outputs.begin(), file.outputs.end(),
                       [&](const OnnxValue& output) { return output.shape.size() == dimensions; });
  };
  const std::size_t count = file.outputs.size();
  return has_output_of(3) && (count == 1 || (count == 2 && has_output_of(4)));
}

constexpr bool opencv_runs_exported_yolo = CV_VERSION_MAJOR > 4 ||
                                           (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7);

/// Layers that OpenCV lacks, as exporters call them, with their ONNX domains.
constexpr const char* deformable_layers[] = {
    "DCNv2", "DeformConv", "mmcv.MMCVModulatedDeformConv2d", "mmdeploy.MMCVModulatedDeformConv2d"};

/// Loads a network, which keeps its layers. OpenCV forgets their types again. One at a time: OpenCV
/// takes no type twice, and its list belongs to the whole process.
cv::dnn::Net loaded(const std::vector<char>& bytes) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  const std::shared_ptr<void> forget(nullptr, [](void*) {
    for (const char* type : deformable_layers) cv::dnn::LayerFactory::unregisterLayer(type);
  });
  for (const char* type : deformable_layers) {
    cv::dnn::LayerFactory::registerLayer(type, make_deformable_convolution);
  }
  return cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
}

}  // namespace

std::vector<double> numbers_in(std::string text) {
  for (char& letter : text) {
    if (std::string("0123456789.+-eE").find(letter) == std::string::npos) letter = ' ';
  }
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  return {std::istream_iterator<double>(stream), {}};
}

Network::Network(const std::filesystem::path& path, const NetworkOptions& options)
    : path_(path), file_(read_onnx_file(path)) {
  find_input(options.input_size);
  try {
    net_ = loaded(file_.bytes);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail_in_opencv(error);
  }
  if (net_.empty()) fail("OpenCV makes an empty network of it");
  use_device(options.device);
  file_.bytes = {};  // OpenCV has copied the weights
}

void Network::find_input(const cv::Size& size_where_open) {
  if (file_.inputs.size() != 1) fail(concatenate("has ", file_.inputs.size(), " inputs; want 1"));
  const std::vector<int>& shape = file_.inputs[0].shape;
  const std::string what =
      "its input " + file_.inputs[0].name + " has the shape " + shape_text(shape);
  const auto is_color = [&](std::size_t i) { return shape[i] == 3 || shape[i] == 0; };
  const bool is_image = shape.size() == 4 && (is_color(1) || is_color(3));
  if (!is_image) fail(what + "; want [1, 3, rows, columns] or [1, rows, columns, 3]");
  if (shape[0] > 1) fail(what + "; export it for one image (batch=1)");
  has_channels_last_ = shape[3] == 3 && shape[1] != 3;
  const std::size_t rows = has_channels_last_ ? 1 : 2;
  input_size_ = {shape[rows + 1], shape[rows]};
  const bool is_fixed = !input_size_.empty();
  if (is_fixed && !size_where_open.empty() && size_where_open != input_size_) {
    fail("has an input of " + size_name(input_size_) + ", but NetworkOptions::input_size is " +
         size_name(size_where_open));
  }
  if (!is_fixed) input_size_ = size_where_open;
  const std::vector<double> written = numbers_in(metadata("imgsz"));  // rows, columns
  if (input_size_.empty() && written.size() == 2) {
    input_size_ = {cv::saturate_cast<int>(written[1]), cv::saturate_cast<int>(written[0])};
  }
  if (input_size_.empty()) {
    fail(
        "leaves the size of its input open: export it with a fixed size (dynamic=False), or set "
        "NetworkOptions::input_size (Python: input_size=(width, height))");
  }
  if (!is_sane_input(input_size_)) {
    fail(concatenate("has an input of ", size_name(input_size_), "; want at most ",
                     max_input_pixels, " pixels"));
  }
}

void Network::use_device(const std::string& device) {
  constexpr struct {
    const char* name;
    cv::dnn::Backend backend;
    cv::dnn::Target target;
  } devices[] = {{"cpu", cv::dnn::DNN_BACKEND_OPENCV, cv::dnn::DNN_TARGET_CPU},
                 {"opencl", cv::dnn::DNN_BACKEND_OPENCV, cv::dnn::DNN_TARGET_OPENCL},
                 {"cuda", cv::dnn::DNN_BACKEND_CUDA, cv::dnn::DNN_TARGET_CUDA},
                 {"openvino", cv::dnn::DNN_BACKEND_INFERENCE_ENGINE, cv::dnn::DNN_TARGET_CPU}};
  for (const auto& [name, backend, target] : devices) {
    if (device != name) continue;
    const std::vector<cv::dnn::Target> found = cv::dnn::getAvailableTargets(backend);
    if (std::find(found.begin(), found.end(), target) == found.end()) {
      fail("cannot run on " + device +
           ": OpenCV " CV_VERSION " was built without it, or finds no such device");
    }
    net_.setPreferableBackend(backend);
    net_.setPreferableTarget(target);
    return;
  }
  throw_misuse("NetworkSegmenter", "the device \"" + device + '"', "cpu, opencl, cuda or openvino");
}

std::string Network::metadata(const std::string& key) const {
  const auto entry = file_.metadata.find(key);
  return entry == file_.metadata.end() ? std::string() : entry->second;
}

std::vector<NamedTensor> Network::forward(const cv::Mat& input) {
  std::vector<cv::String> names;
  for (const OnnxValue& output : file_.outputs) {
    if (file_.constants.count(output.name) == 0) names.push_back(output.name);
  }
  std::vector<cv::Mat> computed;
  try {
    net_.setInput(has_channels_last_ ? channels_last(input) : input);
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
      fail("its output " + output.name + " is no tensor of floats; export scores, without ArgMax");
    }
    outputs.push_back({output.name, data});
  }
  return outputs;
}

void Network::fail(const std::string& what) const { throw_file_error(path_, what); }

void Network::fail_in_opencv(const std::exception& error) const {
  const auto* opencv_error = dynamic_cast<const cv::Exception*>(&error);
  std::string said = opencv_error != nullptr ? opencv_error->err : error.what();
  std::replace(said.begin(), said.end(), '\n', ' ');
  std::string what = "OpenCV " CV_VERSION " cannot run it";
  if (said.find("FLOAT16") != std::string::npos) {
    what += ": export it with half=False";
  } else if (may_be_exported_yolo(file_)) {
    what +=
        opencv_runs_exported_yolo
            ? ": export YOLO with opset=12, simplify=True, nms=False, end2end=False"
            : ": YOLO as exported needs OpenCV 4.7 or newer; examples/cut_yolo_heads.py makes a "
              "model of it that runs here";
  }
  fail(what + ": " + said);
}

}  // namespace dynfilter::detail
