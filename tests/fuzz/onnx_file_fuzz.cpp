// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Reads arbitrary bytes as an ONNX file: they are refused with an error that names the file, or
// what was read is as promised.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "fuzz/report.hpp"
#include "networks/onnx_file.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

std::string check_onnx(const std::string& bytes) {
  static const TemporaryFolder folder;
  const std::filesystem::path path = folder.write("model.onnx", bytes);
  try {
    const detail::OnnxFile file = detail::read_onnx_file(path);
    if (std::string(file.bytes.begin(), file.bytes.end()) != bytes) return "other bytes were read";
    if (file.outputs.empty()) return "a model without outputs";
    for (const auto& [name, values] : file.constants) {
      if (values.type() != CV_32F || values.empty() || values.dims > 32) return "a wrong constant";
      if (values.total() * 2 > bytes.size()) return "a constant larger than its file";
    }
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find(path.string()) != 0) {
      return std::string("the error names no file: ") + error.what();
    }
  }
  return {};
}

}  // namespace
}  // namespace dynfilter::testing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dynfilter::testing;
  return report(check_onnx({reinterpret_cast<const char*>(data), size}));
}
