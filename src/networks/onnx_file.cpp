// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "onnx_file.hpp"

#include <cstddef>
#include <fstream>
#include <ios>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/file_error.hpp"
#include "protobuf_reader.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;

// The numbers, from the ONNX project's onnx.proto3, of the fields that are read.
enum ModelField { model_graph = 7, model_metadata = 14 };
enum GraphField { graph_node = 1, graph_initializer = 5, graph_input = 11, graph_output = 12 };
enum NodeField { node_input = 1, node_output = 2, node_op_type = 4, node_attribute = 5 };
enum AttributeField { attribute_tensor = 5 };
enum TensorField {
  tensor_dims = 1,
  tensor_data_type = 2,
  tensor_float_data = 4,
  tensor_name = 8,
  tensor_raw_data = 9,
  tensor_external_data = 13
};
enum ValueField { value_name = 1, value_type = 2 };
enum TypeField { type_tensor = 1, tensor_type_shape = 2, shape_dimension = 1, dimension_size = 1 };
constexpr std::int64_t float_type = 1;
constexpr std::int64_t max_table_side = 1 << 24;  // so that the size of a table does not overflow

// The limit of protocol buffers. A larger file is no model, and would have to fit into memory.
constexpr std::uintmax_t max_file_bytes = (std::uintmax_t{1} << 31) - 1;

using Constants = std::map<std::string, std::string_view>;  // tensors by name

std::pair<std::string, std::string> read_entry(std::string_view entry) {
  return {std::string(part_of(entry, 1)), std::string(part_of(entry, 2))};
}

OnnxValue read_value(std::string_view value) {
  OnnxValue result{std::string(part_of(value, value_name)), {}};
  const std::string_view tensor = part_of(part_of(value, value_type), type_tensor);
  for (const std::string_view dimension :
       parts_of(part_of(tensor, tensor_type_shape), shape_dimension)) {
    const std::vector<std::int64_t> sizes = numbers_of(dimension, dimension_size);
    const std::int64_t size = sizes.empty() ? 0 : sizes.back();
    const bool is_known = size > 0 && size <= std::numeric_limits<int>::max();
    result.shape.push_back(is_known ? static_cast<int>(size) : 0);
  }
  return result;
}

/// Returns the constant tensors: initializers, and what the nodes Constant and Identity forward.
Constants constants_of(std::string_view graph) {
  Constants constants;
  for (const std::string_view tensor : parts_of(graph, graph_initializer)) {
    constants[std::string(part_of(tensor, tensor_name))] = tensor;
  }
  for (const std::string_view node : parts_of(graph, graph_node)) {  // in their order
    const std::string_view type = part_of(node, node_op_type);
    const std::string output(part_of(node, node_output));
    if (type == "Constant") {
      const std::string_view value = part_of(part_of(node, node_attribute), attribute_tensor);
      if (!value.empty()) constants[output] = value;
    }
    const auto source = constants.find(std::string(part_of(node, node_input)));
    if (type == "Identity" && source != constants.end()) constants[output] = source->second;
  }
  return constants;
}

/// Returns the numbers of a table of floats; an empty matrix for any other tensor.
cv::Mat table_of(std::string_view tensor) {
  const std::vector<std::int64_t> type = numbers_of(tensor, tensor_data_type);
  const std::vector<std::int64_t> sides = numbers_of(tensor, tensor_dims);
  const auto is_side = [](std::int64_t side) { return side >= 1 && side <= max_table_side; };
  if (type.empty() || type.back() != float_type || sides.size() != 2) return {};
  if (!is_side(sides[0]) || !is_side(sides[1])) return {};
  std::string data(part_of(tensor, tensor_raw_data));
  for (const std::string_view part : parts_of(tensor, tensor_float_data)) data += part;
  if (data.size() != static_cast<std::size_t>(sides[0] * sides[1]) * sizeof(float)) return {};
  return cv::Mat(static_cast<int>(sides[0]), static_cast<int>(sides[1]), CV_32F, data.data())
      .clone();
}

void refuse_external_data(const fs::path& path, std::string_view tensor) {
  for (const std::string_view entry : parts_of(tensor, tensor_external_data)) {
    const auto [key, value] = read_entry(entry);
    if (key != "location") continue;
    const fs::path file = path.parent_path() / value;
    std::error_code ignored;
    throw_file_error(path, "its weights are in another file, " + file.string() +
                               (fs::exists(file, ignored) ? "" : ", which is not there") +
                               "; save the model as one file (onnx.save_model, in Python)");
  }
}

std::vector<char> read_bytes(const fs::path& path) {
  std::error_code unreadable;
  const std::uintmax_t size = fs::file_size(path, unreadable);
  if (unreadable) throw_file_error(path, "cannot be read: " + unreadable.message());
  if (size > max_file_bytes) {
    throw_file_error(path, "is no ONNX model: got " + std::to_string(size) +
                               " bytes; want at most " + std::to_string(max_file_bytes));
  }
  std::vector<char> bytes(static_cast<std::size_t>(size));
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    throw_file_error(path, "cannot be read");
  }
  return bytes;
}

void read_model(const fs::path& path, OnnxFile& file) {
  const std::string_view model(file.bytes.data(), file.bytes.size());
  for (const std::string_view entry : parts_of(model, model_metadata)) {
    file.metadata.insert(read_entry(entry));
  }
  const std::string_view graph = part_of(model, model_graph);
  const std::vector<std::string_view> outputs = parts_of(graph, graph_output);
  if (outputs.empty() || parts_of(graph, graph_node).empty()) {
    throw MalformedMessage("it has no layers or no outputs");
  }
  const Constants constants = constants_of(graph);
  for (const auto& [name, tensor] : constants) refuse_external_data(path, tensor);
  for (const std::string_view part : parts_of(graph, graph_input)) {
    const OnnxValue input = read_value(part);
    if (constants.count(input.name) == 0) file.inputs.push_back(input);
  }
  for (const std::string_view part : outputs) {
    file.outputs.push_back(read_value(part));
    const std::string& name = file.outputs.back().name;
    const auto constant = constants.find(name);
    if (constant == constants.end()) continue;
    file.constants[name] = table_of(constant->second);
    if (!file.constants[name].empty()) continue;
    throw_file_error(path, "its constant output " + name + " is no whole table of floats");
  }
}

}  // namespace

OnnxFile read_onnx_file(const fs::path& path) {
  OnnxFile file;
  file.bytes = read_bytes(path);
  try {
    read_model(path, file);
  } catch (const MalformedMessage& error) {
    const std::string other = in_place_of({file.bytes.data(), file.bytes.size()});
    if (!other.empty()) throw_file_error(path, other);
    throw_file_error(path, std::string("is truncated or no ONNX model: ") + error.what() +
                               "; other weights can be exported, Ultralytics' .pt by `yolo export "
                               "model=NAME.pt format=onnx`");
  }
  return file;
}

}  // namespace dynfilter::detail
