// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Joins texts and numbers into one text. Not inlined: errors are rare, and need not be fast.
template <class... Parts>
[[gnu::cold, gnu::noinline]] std::string concatenate(const Parts&... parts) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());  // no digit grouping, whatever the host's locale
  (stream << ... << parts);
  return stream.str();
}

/// Throws std::invalid_argument: "dynfilter::<component>: got <got>; want <want>".
[[noreturn, gnu::cold, gnu::noinline]] inline void throw_misuse(const char* component,
                                                                const std::string& got,
                                                                const std::string& want) {
  throw std::invalid_argument(
      concatenate("dynfilter::", component, ": got ", got, "; want ", want));
}

/// Check of the options of a component.
class OptionCheck {
 public:
  explicit constexpr OptionCheck(const char* component) : component_(component) {}

  /// Throws std::invalid_argument where an option is not good: "dynfilter::<component>: got <name>
  /// = <value>; want <want>".
  template <class Value>
  void operator()(bool is_good, const char* name, const Value& value, const char* want) const {
    if (!is_good) throw_misuse(component_, concatenate(name, " = ", value), want);
  }

 private:
  const char* component_;
};

/// Returns the name of a matrix's type as users write it: "CV_16UC1".
inline std::string type_name(const cv::Mat& matrix) {
  static constexpr const char* depths[] = {"CV_8U",  "CV_8S",  "CV_16U", "CV_16S",
                                           "CV_32S", "CV_32F", "CV_64F", "CV_16F"};
  return concatenate(depths[matrix.depth() & 7], "C", matrix.channels());
}

/// Returns a size as "640x480" (width x height).
inline std::string size_name(const cv::Size& size) {
  return concatenate(size.width, "x", size.height);
}

/// Returns a matrix's size as "640x480" (width x height), of more dimensions in their order.
inline std::string size_name(const cv::Mat& matrix) {
  if (matrix.dims <= 2) return size_name(cv::Size(matrix.cols, matrix.rows));
  std::string name = concatenate(matrix.size[0]);
  for (int k = 1; k < matrix.dims; ++k) name += concatenate("x", matrix.size[k]);
  return name;
}

/// Tells whether a matrix has two dimensions and this size.
inline bool has_size(const cv::Mat& matrix, const cv::Size& size) {
  return matrix.dims <= 2 && matrix.cols == size.width && matrix.rows == size.height;
}

}  // namespace dynfilter::detail
