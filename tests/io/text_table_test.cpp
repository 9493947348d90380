// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/text_table.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

using Rows = std::vector<std::vector<std::string>>;

Rows rows_of(const std::string& bytes) {
  const testing::TemporaryFolder folder;
  TableReader table(folder.write("table.txt", bytes));
  Rows rows;
  while (table.next()) {
    rows.emplace_back();
    for (std::size_t i = 0; i < table.columns(); ++i) rows.back().push_back(table.text(i));
  }
  return rows;
}

/// Returns ASCII as UTF-16 with its byte order mark.
std::string utf16(const std::string& text, bool is_little) {
  std::string bytes = is_little ? "\xFF\xFE" : "\xFE\xFF";
  for (const char c : text) {
    bytes += is_little ? c : '\0';
    bytes += is_little ? '\0' : c;
  }
  return bytes;
}

TEST(TextTable, ReadsAnyLineEndsEncodingAndSeparator) {
  const Rows want = {{"1.5", "a.png"}, {"2.5", "b.png"}};
  const std::string text = "# list\n1.5 a.png\n\n2.5\tb.png";
  std::string mac = text, windows;
  for (char& c : mac) c = c == '\n' ? '\r' : c;
  for (const char c : text) windows += c == '\n' ? "\r\n" : std::string(1, c);
  for (const std::string& bytes :
       {text, mac, windows, "\xEF\xBB\xBF" + text, utf16(windows, true), utf16(mac, false),
        std::string("1.5,a.png\n2.5, b.png\n"), std::string("1.5;a.png\n2.5 ; b.png\n")}) {
    EXPECT_EQ(rows_of(bytes), want) << bytes;
  }
}

TEST(TextTable, CommasWithinCellsDivideNothing) {
  EXPECT_EQ(rows_of("1.5 a,b.png\n"), (Rows{{"1.5", "a,b.png"}}));
  EXPECT_EQ(rows_of("0,5 1,5\n"), (Rows{{"0,5", "1,5"}}));
  EXPECT_EQ(rows_of("0,5;1,5\n"), (Rows{{"0,5", "1,5"}}));
}

TEST(TextTable, CountsLinesWithAnyEnds) {
  const testing::TemporaryFolder folder;
  TableReader table(folder.write("table.txt", "1\r\r\n3\n\r4"));
  for (const std::size_t line : {1U, 3U, 5U}) {
    ASSERT_TRUE(table.next());
    EXPECT_EQ(table.line(), line);
  }
}

TEST(TextTable, NamesUtf16WithoutItsMark) {
  testing::expect_error<std::runtime_error>([] { rows_of(std::string("1\0 \0", 4)); },
                                            "holds zero bytes: UTF-16 without a byte order mark");
}

}  // namespace
}  // namespace dynfilter::detail
