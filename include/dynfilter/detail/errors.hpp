// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_ERRORS_HPP
#define DYNFILTER_DETAIL_ERRORS_HPP

#include <cstdint>
#include <initializer_list>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// One part of a message: a number, or a text that outlives it.
class MessagePart {
 public:
  MessagePart(const char* text) : kind_(Kind::text), text_(text) {}
  MessagePart(const std::string& text) : kind_(Kind::text), text_(text.c_str()) {}
  MessagePart(char letter) : kind_(Kind::letter), letter_(letter) {}
  MessagePart(double number) : kind_(Kind::real), real_(number) {}
  template <class Integer, std::enable_if_t<std::is_integral<Integer>::value, int> = 0>
  MessagePart(Integer number)
      : kind_(std::is_signed<Integer>::value ? Kind::negative_or_not : Kind::natural),
        integer_(static_cast<std::uint64_t>(number)) {}

  void print(std::ostream& stream) const {
    if (kind_ == Kind::text) stream << text_;
    if (kind_ == Kind::letter) stream << letter_;
    if (kind_ == Kind::real) stream << real_;
    if (kind_ == Kind::natural) stream << integer_;
    if (kind_ == Kind::negative_or_not) stream << static_cast<std::int64_t>(integer_);
  }

 private:
  enum class Kind { text, letter, real, natural, negative_or_not };

  Kind kind_;
  union {
    const char* text_;
    char letter_;
    double real_;
    std::uint64_t integer_;
  };
};

/// Joins the parts of a message. Not inlined: errors are rare, and need not be fast.
[[gnu::cold, gnu::noinline]] inline std::string join(std::initializer_list<MessagePart> parts) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());  // no digit grouping, whatever the host's locale
  for (const MessagePart& part : parts) part.print(stream);
  return stream.str();
}

/// Joins texts and numbers into one text.
template <class... Parts>
[[gnu::cold]] std::string concatenate(const Parts&... parts) {
  return join({MessagePart(parts)...});
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
  void operator()(bool is_good, const char* name, const MessagePart& value,
                  const char* want) const {
    if (!is_good) throw_misuse(component_, join({name, " = ", value}), want);
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

/// Returns the size of a matrix as "640x480" (width x height), of one with more dimensions in their
/// order.
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

#endif  // DYNFILTER_DETAIL_ERRORS_HPP
