// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Numbers in texts: of messages, and of files.

#include <locale>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "support/test.hpp"

namespace dynfilter::detail {
namespace {

TEST(Concatenate, PrintsPartsAsAStreamDoes) {
  const std::string text = "text";
  EXPECT_EQ(concatenate("a ", text, '"', 'b', '"'), "a text\"b\"");
  EXPECT_EQ(concatenate(-7, " ", 7U, " ", std::size_t{8}, " ", std::int16_t{-9}), "-7 7 8 -9");
  EXPECT_EQ(concatenate(std::numeric_limits<std::int64_t>::min()), "-9223372036854775808");
  EXPECT_EQ(concatenate(std::numeric_limits<std::uint64_t>::max()), "18446744073709551615");
  EXPECT_EQ(concatenate(0.1, " ", 1e-9, " ", 0.25F, " ", 1234567.0), "0.1 1e-09 0.25 1.23457e+06");
}

TEST(SizeName, IsWidthTimesHeightOrAllDimensions) {
  EXPECT_EQ(size_name(cv::Mat(480, 640, CV_8UC1)), "640x480");
  EXPECT_EQ(size_name(cv::Mat()), "0x0");
  EXPECT_EQ(size_name(cv::Mat({2, 3, 4}, CV_8UC1)), "2x3x4");
  EXPECT_FALSE(has_size(cv::Mat({2, 3, 4}, CV_8UC1), {3, 2}));
}

TEST(NumberText, ParsesTheWholeTextOrNothing) {
  EXPECT_EQ(parse_number("12.5"), 12.5);
  EXPECT_EQ(parse_number("-1e3"), -1000.0);
  EXPECT_EQ(parse_number("+0.25"), 0.25);
  for (const char* text :
       {"", " 1", "1 ", "1\n", "1\t2", "1,5", "1.5m", "abc", "1e999", "nan", "inf"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << "'" << text << "'";
  }
}

/// Writes 1234.5 as 1.234,5.
struct GermanNumbers : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(NumberText, IsTheSameInAnyLocale) {
  const std::locale before = std::locale::global(std::locale(std::locale(), new GermanNumbers));
  const auto parsed = parse_number("1234.5");
  const std::string fixed = fixed_decimals(1341846434.710184, 6);
  const std::string printed = concatenate(1234567, " ", 0.5);
  std::locale::global(before);
  EXPECT_EQ(parsed, 1234.5);
  EXPECT_EQ(fixed, "1341846434.710184");
  EXPECT_EQ(printed, "1234567 0.5");
}

TEST(NumberText, TimesLieWithinNineBillionSeconds) {
  for (const double inside : {0.0, -1.5, std::nextafter(9e9, 0), -std::nextafter(9e9, 0)}) {
    EXPECT_TRUE(is_time_in_seconds(inside)) << inside;
  }
  for (const double outside :
       {9e9, -9e9, 1e300, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_FALSE(is_time_in_seconds(outside)) << outside;
  }
}

TEST(NumberText, TimesAreComparedInWholeMicroseconds) {
  EXPECT_EQ(microseconds(1341846434.710184), 1341846434710184);
  EXPECT_EQ(microseconds(-0.0000026), -3);
  EXPECT_EQ(time_text(1.5), "1.500000");
  EXPECT_EQ(time_text(-0.0000026), "-0.000003");
}

}  // namespace
}  // namespace dynfilter::detail
