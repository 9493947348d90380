// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/errors.hpp"

#include <gtest/gtest.h>

#include <clocale>
#include <cstdint>
#include <limits>
#include <locale>
#include <string>

#include "support/expect_error.hpp"

namespace dynfilter::detail {
namespace {

TEST(Concatenate, PrintsPartsAsAStreamDoes) {
  const std::string text = "text";
  EXPECT_EQ(concatenate("a ", text, '"', 'b', '"'), "a text\"b\"");
  EXPECT_EQ(concatenate(-7, " ", 7U, " ", std::size_t{8}, " ", std::int16_t{-9}), "-7 7 8 -9");
  EXPECT_EQ(concatenate(std::numeric_limits<std::int64_t>::min()), "-9223372036854775808");
  EXPECT_EQ(concatenate(std::numeric_limits<std::uint64_t>::max()), "18446744073709551615");
  EXPECT_EQ(concatenate(0.1, " ", 1e-9, " ", 0.25F, " ", 1234567.0), "0.1 1e-09 0.25 1.23457e+06");
  EXPECT_EQ(concatenate(), "");
}

struct CommaPunctuation : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Concatenate, IgnoresTheLocaleOfTheHost) {
  const std::locale before = std::locale::global(std::locale({}, new CommaPunctuation));
  const std::string text = concatenate(1234567, " ", 0.5);
  std::locale::global(before);
  EXPECT_EQ(text, "1234567 0.5");
}

TEST(SizeName, IsWidthTimesHeightOrAllDimensions) {
  EXPECT_EQ(size_name(cv::Size(640, 480)), "640x480");
  EXPECT_EQ(size_name(cv::Mat(480, 640, CV_8UC1)), "640x480");
  EXPECT_EQ(size_name(cv::Mat()), "0x0");
  EXPECT_EQ(size_name(cv::Mat({2, 3, 4}, CV_8UC1)), "2x3x4");
  EXPECT_TRUE(has_size(cv::Mat(480, 640, CV_8UC1), {640, 480}));
  EXPECT_FALSE(has_size(cv::Mat(480, 640, CV_8UC1), {480, 640}));
  EXPECT_FALSE(has_size(cv::Mat({2, 3, 4}, CV_8UC1), {3, 2}));
}

TEST(ThrowMisuse, NamesTheComponentWhatItGotAndWhatItWants) {
  testing::expect_error<std::invalid_argument>(
      [] { throw_misuse("Component", concatenate("size ", 3), "an even one"); },
      "dynfilter::Component: got size 3; want an even one");
}

}  // namespace
}  // namespace dynfilter::detail
