// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_ERRORS_HPP
#define DYNFILTER_DETAIL_ERRORS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

template <class... Parts>
std::string concatenate(const Parts&... parts) {
  std::ostringstream text;
  text.imbue(std::locale::classic());  // 1e6 is not 1,000,000, whatever the host has set
  (text << ... << parts);
  return text.str();
}

/// Misuse: "dynfilter::<component>: got <got>; want <want>".
[[noreturn]] inline void throw_misuse(const char* component, const std::string& got,
                                      const std::string& want) {
  throw std::invalid_argument(
      concatenate("dynfilter::", component, ": got ", got, "; want ", want));
}

/// "CV_16UC1" for a matrix of that type, so that messages speak the caller's language.
inline std::string type_name(const cv::Mat& matrix) {
  static constexpr const char* depths[] = {"CV_8U",  "CV_8S",  "CV_16U", "CV_16S",
                                           "CV_32S", "CV_32F", "CV_64F", "CV_16F"};
  return concatenate(depths[matrix.depth() & 7], "C", matrix.channels());
}

/// "640x480" (width x height), as people write it.
inline std::string size_name(const cv::Size& size) {
  return concatenate(size.width, "x", size.height);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_ERRORS_HPP
