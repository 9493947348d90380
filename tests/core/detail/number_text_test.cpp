// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/number_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <locale>

namespace dynfilter::testing {
namespace {

/// Writes 1234.5 as 1.234,5.
struct GermanNumbers : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(NumberText, ParsesTheWholeTextOrNothing) {
  EXPECT_EQ(detail::parse_number("12.5"), 12.5);
  EXPECT_EQ(detail::parse_number("-1e3"), -1000.0);
  EXPECT_EQ(detail::parse_number("+0.25"), 0.25);
  for (const char* text :
       {"", " 1", "1 ", "1\n", "1\t2", "1,5", "1.5m", "abc", "1e999", "nan", "inf"}) {
    EXPECT_EQ(detail::parse_number(text), std::nullopt) << "'" << text << "'";
  }
}

TEST(NumberText, IsTheSameInAnyLocale) {
  const std::locale before = std::locale::global(std::locale(std::locale(), new GermanNumbers));
  const auto parsed = detail::parse_number("1234.5");
  const std::string text = detail::fixed_decimals(1341846434.710184, 6);
  std::locale::global(before);
  EXPECT_EQ(parsed, 1234.5);
  EXPECT_EQ(text, "1341846434.710184");
}

TEST(NumberText, TimesLieWithinNineBillionSeconds) {
  for (const double inside : {0.0, -1.5, std::nextafter(9e9, 0), -std::nextafter(9e9, 0)}) {
    EXPECT_TRUE(detail::is_time_in_seconds(inside)) << inside;
  }
  for (const double outside :
       {9e9, -9e9, 1e300, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_FALSE(detail::is_time_in_seconds(outside)) << outside;
  }
}

TEST(NumberText, TimesAreComparedInWholeMicroseconds) {
  EXPECT_EQ(detail::microseconds(1341846434.710184), 1341846434710184);
  EXPECT_EQ(detail::microseconds(-0.0000026), -3);
  EXPECT_EQ(detail::time_text(1.5), "1.500000");
  EXPECT_EQ(detail::time_text(-0.0000026), "-0.000003");
}

}  // namespace
}  // namespace dynfilter::testing
