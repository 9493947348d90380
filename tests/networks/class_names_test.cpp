// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/class_names.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace dynfilter::detail {
namespace {

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
