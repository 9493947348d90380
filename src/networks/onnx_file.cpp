// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "onnx_file.hpp"

#include <cstddef>
#include <cstring>
#include <fstream>
#include <ios>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/file_error.hpp"
#include "protobuf_reader.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;

// The numbers, from the ONNX project's onnx.proto3, of the fields that are read.
namespace model_field {
constexpr int graph = 7, metadata = 14;
}
namespace graph_field {
constexpr int node = 1, initializer = 5, input = 11, output = 12;
}
namespace node_field {
constexpr int input = 1, output = 2, op_type = 4, attribute = 5;
}
namespace attribute_field {
constexpr int tensor = 5;
}
namespace tensor_field {
constexpr int dims = 1, data_type = 2, float_data = 4, name = 8, raw_data = 9, external_data = 13;
}
namespace value_field {
constexpr int name = 1, type = 2;
}
constexpr std::int64_t float_type = 1;
constexpr std::size_t max_dimensions = 32;  // the limit of cv::Mat

// The limit of protocol buffers. A larger file is no model, and would have to fit into memory.
constexpr std::uintmax_t max_file_bytes = (std::uintmax_t{1} << 31) - 1;

struct Tensor {
  std::string name;
  std::vector<std::int64_t> shape;
  std::int64_t data_type = 0;
  std::string_view raw_data;
  std::vector<std::string_view> float_data;
  std::optional<std::string> external_file;
};

struct Node {
  std::string op_type;
  std::vector<std::string> inputs, outputs;
  std::optional<Tensor> value;  // the value of a Constant
};

/// The graph as views into the file's bytes.
struct Graph {
  bool has_nodes = false;
  std::vector<Node> constants;  // the nodes that hold or forward a constant
  std::vector<Tensor> initializers;
  std::vector<OnnxValue> inputs, outputs;
};

std::pair<std::string, std::string> read_entry(ProtobufReader reader) {
  std::pair<std::string, std::string> entry;
  while (reader.next()) {
    if (reader.field() == 1) entry.first = reader.text();
    if (reader.field() == 2) entry.second = reader.text();
  }
  return entry;
}

void read_dims(ProtobufReader& reader, std::vector<std::int64_t>& shape) {
  if (reader.is_number()) {
    shape.push_back(reader.number());
    return;
  }
  for (std::string_view packed = reader.bytes(); !packed.empty();) {
    shape.push_back(static_cast<std::int64_t>(ProtobufReader::take_varint(packed)));
  }
}

Tensor read_tensor(ProtobufReader reader) {
  Tensor tensor;
  while (reader.next()) {
    switch (reader.field()) {
      case tensor_field::dims:
        read_dims(reader, tensor.shape);
        break;
      case tensor_field::data_type:
        tensor.data_type = reader.number();
        break;
      case tensor_field::float_data:
        tensor.float_data.push_back(reader.bytes());
        break;
      case tensor_field::name:
        tensor.name = reader.text();
        break;
      case tensor_field::raw_data:
        tensor.raw_data = reader.bytes();
        break;
      case tensor_field::external_data: {
        const auto [key, value] = read_entry(reader.message());
        if (key == "location") tensor.external_file = value;
        break;
      }
      default:
        break;
    }
  }
  return tensor;
}

Node read_node(ProtobufReader reader) {
  Node node;
  while (reader.next()) {
    switch (reader.field()) {
      case node_field::input:
        node.inputs.push_back(reader.text());
        break;
      case node_field::output:
        node.outputs.push_back(reader.text());
        break;
      case node_field::op_type:
        node.op_type = reader.text();
        break;
      case node_field::attribute:
        for (ProtobufReader attribute = reader.message(); attribute.next();) {
          if (attribute.field() == attribute_field::tensor) {
            node.value = read_tensor(attribute.message());
          }
        }
        break;
      default:
        break;
    }
  }
  return node;
}

/// Reads one dimension of a shape; 0 if it has a name or nothing in place of a number.
int read_side(ProtobufReader reader) {
  std::int64_t side = 0;
  while (reader.next()) {
    if (reader.field() == 1) side = reader.number();
  }
  return side > 0 && side <= std::numeric_limits<int>::max() ? static_cast<int>(side) : 0;
}

OnnxValue read_value(ProtobufReader reader) {
  OnnxValue value;
  while (reader.next()) {
    if (reader.field() == value_field::name) value.name = reader.text();
    if (reader.field() != value_field::type) continue;
    for (ProtobufReader type = reader.message(); type.next();) {
      if (type.field() != 1) continue;  // a tensor
      for (ProtobufReader tensor = type.message(); tensor.next();) {
        if (tensor.field() != 2) continue;  // its shape
        for (ProtobufReader shape = tensor.message(); shape.next();) {
          if (shape.field() == 1) value.shape.push_back(read_side(shape.message()));
        }
      }
    }
  }
  return value;
}

Graph read_graph(ProtobufReader reader) {
  Graph graph;
  while (reader.next()) {
    switch (reader.field()) {
      case graph_field::node: {
        Node node = read_node(reader.message());
        graph.has_nodes = true;
        if (node.value || node.op_type == "Identity") graph.constants.push_back(std::move(node));
        break;
      }
      case graph_field::initializer:
        graph.initializers.push_back(read_tensor(reader.message()));
        break;
      case graph_field::input:
        graph.inputs.push_back(read_value(reader.message()));
        break;
      case graph_field::output:
        graph.outputs.push_back(read_value(reader.message()));
        break;
      default:
        break;
    }
  }
  return graph;
}

/// Returns the values of a float tensor; an empty matrix for another type, for more dimensions than
/// cv::Mat allows, or for a count that does not match the shape.
cv::Mat values_of(const Tensor& tensor) {
  if (tensor.data_type != float_type || tensor.shape.empty()) return {};
  if (tensor.shape.size() > max_dimensions) return {};
  std::vector<int> shape;
  std::size_t count = 1;
  for (const std::int64_t side : tensor.shape) {
    if (side < 1 || side > 1 << 24 || count > (std::size_t{1} << 28)) return {};
    shape.push_back(static_cast<int>(side));
    count *= static_cast<std::size_t>(side);
  }
  std::string bytes(tensor.raw_data);
  for (const std::string_view part : tensor.float_data) bytes += part;
  if (bytes.size() != count * sizeof(float)) return {};
  if (shape.size() == 1) shape.insert(shape.begin(), 1);
  cv::Mat values(static_cast<int>(shape.size()), shape.data(), CV_32F);
  std::memcpy(values.data, bytes.data(), bytes.size());
  return values;
}

/// Returns the constant tensors of the graph by name.
std::map<std::string, const Tensor*> constants_of(const Graph& graph) {
  std::map<std::string, const Tensor*> constants;
  for (const Tensor& tensor : graph.initializers) constants[tensor.name] = &tensor;
  for (const Node& node : graph.constants) {
    if (node.outputs.empty()) continue;
    if (node.op_type == "Constant" && node.value) constants[node.outputs[0]] = &*node.value;
    // Nodes come in the order of computation.
    if (node.op_type == "Identity" && node.inputs.size() == 1 &&
        constants.count(node.inputs[0]) > 0) {
      constants[node.outputs[0]] = constants[node.inputs[0]];
    }
  }
  return constants;
}

void refuse_external_data(const fs::path& path, const Tensor& tensor) {
  if (!tensor.external_file) return;
  const fs::path file = path.parent_path() / *tensor.external_file;
  const std::string advice = "; save the model as one file (onnx.save_model, in Python)";
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    throw_file_error(path, "its weights are in " + file.string() + ", which is not there" + advice);
  }
  throw_file_error(path, "its weights are in another file, " + file.string() + advice);
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

Graph read_model(ProtobufReader reader, std::map<std::string, std::string>& metadata) {
  std::optional<ProtobufReader> graph;
  while (reader.next()) {
    if (reader.field() == model_field::graph) graph = reader.message();
    if (reader.field() == model_field::metadata) metadata.insert(read_entry(reader.message()));
  }
  return graph ? read_graph(*graph) : Graph();
}

}  // namespace

OnnxFile read_onnx_file(const fs::path& path) {
  OnnxFile file;
  file.bytes = read_bytes(path);
  Graph graph;
  try {
    graph = read_model(ProtobufReader(std::string_view(file.bytes.data(), file.bytes.size())),
                       file.metadata);
  } catch (const MalformedMessage& error) {
    throw_file_error(path, std::string("is truncated or no ONNX model: ") + error.what());
  }
  if (!graph.has_nodes || graph.outputs.empty()) {
    throw_file_error(path, "is truncated or no ONNX model: it has no layers or no outputs");
  }
  for (const Tensor& tensor : graph.initializers) refuse_external_data(path, tensor);
  for (const Node& node : graph.constants) {
    if (node.value) refuse_external_data(path, *node.value);
  }
  const std::map<std::string, const Tensor*> constants = constants_of(graph);
  for (OnnxValue& input : graph.inputs) {
    if (constants.count(input.name) == 0) file.inputs.push_back(std::move(input));
  }
  for (OnnxValue& output : graph.outputs) {
    const auto constant = constants.find(output.name);
    if (constant != constants.end()) {
      const cv::Mat values = values_of(*constant->second);
      if (values.empty()) {
        throw_file_error(path, "its constant output " + output.name +
                                   " is no whole float tensor of 1 to " +
                                   std::to_string(max_dimensions) + " dimensions");
      }
      file.constants[output.name] = values;
    }
    file.outputs.push_back(std::move(output));
  }
  return file;
}

}  // namespace dynfilter::detail
