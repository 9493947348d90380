// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "io/yaml_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::detail {
namespace {

using testing::expect_error;
using testing::TemporaryFolder;

class YamlFileTest : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) const {
    return folder_.write("file.yaml", text);
  }
  std::filesystem::path with(const std::string& value) const {
    return write("%YAML:1.0\nfirst: 1\nkey: " + value + "\nlast: 2\n");
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(YamlFileTest, ReadsNumbersExactly) {
  const std::pair<const char*, double> cases[] = {
      {"0", 0},
      {"-0.0", 0},
      {"5000", 5000},
      {"5000.", 5000},
      {".5", 0.5},
      {"-.5", -0.5},
      {"+3", 3},
      {"1e3", 1000},
      {"1.5E-3", 0.0015},
      {"007.5", 7.5},
      {"2147483647", 2147483647.0},
      {"517.306408", 517.306408},
      {"-2147483648", -2147483648.0},
      {"3 # three", 3},
      {"3# three", 3},
      {"   3  ", 3},
      {"\n  3", 3},
      {"5000000000.0", 5e9},
      {".Inf", std::numeric_limits<double>::infinity()},
      {"-.inf", -std::numeric_limits<double>::infinity()},
  };
  for (const auto& [text, value] : cases) {
    SCOPED_TRACE(text);
    const YamlFile file(with(text));
    EXPECT_EQ(file.number("key"), value);
    EXPECT_EQ(file.number("last"), 2);
    EXPECT_EQ(file.number("none"), std::nullopt);
  }
}

TEST_F(YamlFileTest, ReadsIntegersAndListsOfIntegers) {
  EXPECT_EQ(YamlFile(with("-2147483648")).integer("key", std::numeric_limits<int>::min()),
            std::numeric_limits<int>::min());
  EXPECT_EQ(YamlFile(with("2147483647")).integer("key", 0), std::numeric_limits<int>::max());
  EXPECT_EQ(YamlFile(with("1")).integer("none", 0), std::nullopt);
  const std::pair<const char*, std::vector<int>> cases[] = {
      {"[]", {}},
      {"[ ]", {}},
      {"[0,16]", {0, 16}},
      {"[ -1 , +2,\n    3 ] # three", {-1, 2, 3}},
      {"[ 1, # one, [ 7 ]\n\n# none\n   2147483647 ]", {1, 2147483647}},
      {"\n  - 4\n  -  -5\n", {4, -5}},
  };
  for (const auto& [text, values] : cases) {
    SCOPED_TRACE(text);
    EXPECT_EQ(YamlFile(with(text)).integers("key"), values);
  }
}

TEST_F(YamlFileTest, ReadsStringsLikeOpenCv) {
  EXPECT_EQ(YamlFile(with("\"a # b: [ c\"")).text("key"), "a # b: [ c");
  EXPECT_EQ(YamlFile(with("'it''s'")).text("key"), "it's");
  EXPECT_EQ(YamlFile(with("\"\"")).text("key"), "");
  EXPECT_EQ(YamlFile(with("plain text")).text("key"), "plain text");
  EXPECT_EQ(YamlFile(with("plain text")).text("none"), std::nullopt);
}

TEST_F(YamlFileTest, ReadsFilesFromOtherSystems) {
  const char* const texts[] = {
      "%YAML:1.0\r\n---\r\nkey: 7\r\n",
      "\xEF\xBB\xBF%YAML:1.0\nkey: 7\n",
      "%YAML 1.2\n---\nkey : 7\n...\n",
      "%YAML:1.0\nkey: 7",
      "%YAML:1.0\n  other: { key: 3 }\n  key: 7\n  block:\n    key: 3\n",
      "%YAML:1.0\nother: 1\n...\n---\nkey: 7\n",
      "%YAML:1.0\nkey: !!int 7\n",
      "%YAML:1.0\nother: [ a,\n  key\n  ]\nkey: 7\n",
  };
  for (const char* text : texts) {
    SCOPED_TRACE(text);
    EXPECT_EQ(YamlFile(write(text)).number("key"), 7);
  }
}

TEST_F(YamlFileTest, ErrorsNameFileKeyValueAndExpectation) {
  const auto number = [](const YamlFile& file) { file.number("key"); };
  const auto count = [](const YamlFile& file) { file.integer("key", 0); };
  const auto list = [](const YamlFile& file) { file.integers("key"); };
  const auto text = [](const YamlFile& file) { file.text("key"); };
  const std::string huge = "[ " + std::string(400, '9') + " ]";
  const struct {
    void (*read)(const YamlFile&);
    const char *value, *message;
  } cases[] = {
      {number, "\"3\"", "key: got \"3\"; want a number"},
      {number, "{ a: 1 }", "key: got a map; want a number"},
      {number, "1e999", "key: got 1e999; want a decimal number"},
      {number, "0x1F", "key: got 0x1F; want a decimal number"},
      {number, "-010", "key: got -010; want a decimal number, without leading zeros"},
      {number, "4294967296", "key: got 4294967296; want a number that OpenCV can hold"},
      {count, "3.0", "key: got 3.0; want a whole number from 0 to 2147483647"},
      {count, "-1", "key: got -1; want a whole number from 0 to 2147483647"},
      {count, "[ 3 ]", "key: got a list; want a whole number"},
      {count, "2147483648", "key: got 2147483648; want a whole number"},
      {list, "3", "key: got 3; want a list of whole numbers, as [ 0, 16 ]"},
      {list, "[ 1, 2.5 ]", "key: got 2.5 in it; want a list of whole numbers"},
      {list, "[ 1, [ 2 ] ]", "key: got a list in it; want a list of whole numbers"},
      {list, "[ 1, 2147483648 ]", "key: got 2147483648 in it; want a list of whole numbers"},
      {list, huge.c_str(), "in it; want a list of whole numbers"},
      {list, "[ 01 ]", "each at most 2147483647, without leading zeros"},
      {text, "010", "key: got 010; want a text in quotes"},
      {text, "[ a ]", "key: got a list; want a text in quotes"},
      {text, "1\nkey: 2", "key: got the key 2 times; want it once"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.value);
    const auto path = with(c.value);
    const YamlFile file(path);
    expect_error<std::runtime_error>([&] { c.read(file); }, path.string() + ": key: got ");
    expect_error<std::runtime_error>([&] { c.read(file); }, c.message);
  }
}

TEST_F(YamlFileTest, RefusesAKeyInsideALine) {
  const YamlFile file(write("%YAML:1.0\n{ other: 1, key: 2 }\n"));
  expect_error<std::runtime_error>(
      [&] { file.number("key"); },
      "key: got it within a line, or twice; want it at the beginning of one line");
}

TEST_F(YamlFileTest, RefusesFilesThatAreNotYaml) {
  const std::pair<std::string, const char*> cases[] = {
      {"", "is empty"},
      {"key: 3\n", "whose first line is %YAML:1.0"},
      {"%YAML:1.0\nkey: 3\nkey\n", "(line 3: Missing ':'"},
      {"%YAML:1.0\nkey: 1,5\n", "(line 2: "},
      {std::string("%YAML:1.0\nkey: 3\n\0other: 4\n", 27), "is no text"},
  };
  for (const auto& [text, message] : cases) {
    SCOPED_TRACE(text);
    const auto path = write(text);
    expect_error<std::runtime_error>([&] { YamlFile file(path); },
                                     path.string() + ": is no OpenCV YAML file");
    expect_error<std::runtime_error>([&] { YamlFile file(path); }, message);
  }
}

}  // namespace
}  // namespace dynfilter::detail
