// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Malicious ONNX files: an error names the file before memory is allocated for it.

#include "networks/onnx_file.hpp"

#include "dynfilter/networks/network_segmenter.hpp"
#include "networks/class_names.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::detail {
namespace {

using testing::expect_failure;
using testing::TemporaryFolder;

std::string varint(std::uint64_t value) {
  std::string bytes;
  for (; value >= 0x80; value >>= 7U) bytes += static_cast<char>((value & 0x7FU) | 0x80U);
  return bytes + static_cast<char>(value);
}

std::string field(unsigned number, const std::string& bytes) {
  return varint(number << 3U | 2U) + varint(bytes.size()) + bytes;
}

std::string field(unsigned number, std::uint64_t value) {
  return varint(number << 3U) + varint(value);
}

std::string repeated(const std::string& part, std::size_t count) {
  std::string all;
  all.reserve(part.size() * count);
  for (std::size_t i = 0; i < count; ++i) all += part;
  return all;
}

/// Tensor of ones; all sides but the last are 1.
std::string tensor(std::size_t dimensions, std::uint64_t last_side) {
  return repeated(field(1, 1), dimensions - 1) + field(1, last_side) + field(2, 1) +
         field(9, repeated(std::string("\0\0\x80\x3F", 4), last_side));
}

std::string constant_node(const std::string& name, const std::string& tensor) {
  return field(1, field(2, name) + field(4, "Constant") + field(5, field(5, tensor)));
}

std::string model(const std::string& graph) { return field(7, graph); }

/// Model whose output is a constant.
std::string model_of_constant(const std::string& tensor) {
  return model(constant_node("ones", tensor) + field(12, field(1, "ones")));
}

class OnnxFiles : public ::testing::Test {
 protected:
  void expect_refused(const std::string& bytes, const std::string& message) const {
    const std::filesystem::path file = folder_.write("model.onnx", bytes);
    expect_failure([&] { read_onnx_file(file); }, file.string() + ": " + message);
  }

  OnnxFile read(const std::string& bytes) const {
    return read_onnx_file(folder_.write("model.onnx", bytes));
  }

  const TemporaryFolder folder_;
};

TEST_F(OnnxFiles, ConstantOutputsAreTables) {
  const cv::Mat ones = read(model_of_constant(tensor(2, 3))).constants.at("ones");
  EXPECT_EQ(cv::norm(ones, cv::Mat(1, 3, CV_32F, cv::Scalar(1)), cv::NORM_INF), 0);
  const std::string sides = repeated(field(1, std::uint64_t{1} << 32U), 2);  // product overflows
  for (const std::string& other :
       {tensor(1, 3), tensor(3, 3), tensor(2, 3) + field(2, 10), sides + field(2, 1)}) {
    expect_refused(model_of_constant(other), "its constant output ones is no whole table of");
  }
}

TEST_F(OnnxFiles, RefusesHugeFilesUnread) {
  const std::filesystem::path file = folder_.write("model.onnx", "");
  std::error_code error;
  std::filesystem::resize_file(file, std::uintmax_t{1} << 40U, error);
  if (error)
    GTEST_SKIP() << "the file system cannot hold a file of a terabyte: " << error.message();
  expect_failure([&] { read_onnx_file(file); },
                 file.string() + ": is no ONNX model: got 1099511627776 bytes; want at most");
}

#ifndef __SANITIZE_THREAD__  // its own memory is many times the program's
TEST_F(OnnxFiles, MemoryIsBoundedByTheFile) {
  const std::string many = repeated(field(7, ""), 20000000);  // 40 MB
  const long before = testing::peak_memory_mb();
  const std::string message = "is truncated or no ONNX model: more than 262144 fields in a message";
  expect_refused(many, message);
  expect_refused(model(many), message);
  const std::string packed = field(1, std::string(40000000, '\1'));
  expect_refused(model_of_constant(field(2, 1) + packed), message);
  EXPECT_LT(testing::peak_memory_mb() - before, 700);  // most of it is the test's
}
#endif

TEST_F(OnnxFiles, LargeInputsAreRefused) {
  const auto side = [](std::uint64_t size) { return field(1, field(1, size)); };
  for (const std::uint64_t rows : {5000U, 100000U, 2147483647U}) {
    const std::string shape = side(1) + side(3) + side(rows) + side(100000);
    const std::string input = field(11, field(1, "x") + field(2, field(1, field(2, shape))));
    const auto file = folder_.write(
        "model.onnx", model(field(1, field(4, "Relu")) + input + field(12, field(1, "y"))));
    expect_failure(
        [&] { NetworkSegmenter{file}; },
        "has an input of 100000x" + std::to_string(rows) + "; want at most 16777216 pixels");
  }
}

// --- Names of classes ----------------------------------------------------------------------------

using Names = std::vector<std::string>;

TEST(ClassNames, AreReadAsUltralyticsWritesThem) {
  EXPECT_EQ(parse_class_names("{0: 'person', 1: \"child's toy\"}"),
            (Names{"person", "child's toy"}));
  EXPECT_EQ(parse_class_names(" { 0:'a' ,1 : 'it\\'s' } "), (Names{"a", "it's"}));
  std::string text = "{";
  Names names;
  for (int k = 0; k < 12; ++k) {
    names.push_back("class " + std::to_string(k));
    text += (k == 0 ? "" : ", ") + std::to_string(k) + ": '" + names.back() + "'";
  }
  EXPECT_EQ(parse_class_names(text + "}"), names);
}

TEST(ClassNames, AreNoneInAnyOtherText) {
  for (const char* text :
       {"", "{", "{}", "person", "0: 'a'", "{0: 'a'", "{0: 'a'} b", "{0 'a'}", "{0: a}", "{0: 'a}",
        "{1: 'a'}", "{: 'a'}", "{0: 'a', 2: 'b'}", "{0: 'a', 0: 'b'}", "{0: 'a', 11: 'b'}",
        "{x: 'a'}", "{0: 'a',}", "['a', 'b']"}) {
    EXPECT_TRUE(parse_class_names(text).empty()) << text;
  }
}

}  // namespace
}  // namespace dynfilter::detail
