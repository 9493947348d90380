// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "io/text_table.hpp"

#include "io/frame_names.hpp"
#include "io/frame_table.hpp"
#include "io/yaml_file.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using namespace detail;
using Rows = std::vector<std::vector<std::string>>;

Rows rows_of(const std::string& bytes) {
  const TemporaryFolder folder;
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

TEST(TextTable, AnHourIsNotTooFar) { EXPECT_FALSE(detail::are_too_far_apart({0, 3600, 7200})); }

TEST(TextTable, CommasWithinCellsDivideNothing) {
  EXPECT_EQ(rows_of("1.5 a,b.png\n"), (Rows{{"1.5", "a,b.png"}}));
  EXPECT_EQ(rows_of("0,5 1,5\n"), (Rows{{"0,5", "1,5"}}));
  EXPECT_EQ(rows_of("0,5;1,5\n"), (Rows{{"0,5", "1,5"}}));
}

TEST(TextTable, CountsLinesWithAnyEnds) {
  const TemporaryFolder folder;
  TableReader table(folder.write("table.txt", "1\r\r\n3\n\r4"));
  for (const std::size_t line : {1U, 3U, 5U}) {
    ASSERT_TRUE(table.next());
    EXPECT_EQ(table.line(), line);
  }
}

TEST(TextTable, NamesUtf16WithoutItsMark) {
  expect_failure([] { rows_of(std::string("1\0 \0", 4)); },
                 "holds zero bytes: UTF-16 without a byte order mark");
}

TEST(TextTable, MessagesAreOneShortLine) {
  const TemporaryFolder folder;
  const std::string cell = std::string(1000000, 'x') + "\x1B[2J";
  TableReader table(folder.write("table.txt", cell + '\n'));
  ASSERT_TRUE(table.next());
  try {
    table.number(0, "time");
    FAIL();
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    EXPECT_LT(what.size(), 1100U);
    EXPECT_FALSE(has_control(what)) << what;
    EXPECT_NE(what.find("?[2J'; want a finite number"), what.npos) << what;
  }
}

/// If each ending cost the rest of the name, the test would run into its time limit.
TEST(FrameNames, LongNamesTakeNoTime) {
  std::string name = "1.5";
  for (int k = 0; k < 1000000; ++k) name += ".png";
  EXPECT_EQ(frame_stem(name), "1.5");
}

// --- YAML ----------------------------------------------------------------------------------------

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

TEST_F(YamlFileTest, ReadsWhatTheHostReads) {
  const std::pair<const char*, double> numbers[] = {{"0", 0},
                                                    {"5000.", 5000},
                                                    {"-.5", -0.5},
                                                    {"1.5E-3", 0.0015},
                                                    {"3 # 99999999999", 3},
                                                    {"2147483647", 2147483647},
                                                    {"-2147483648", -2147483648.0},
                                                    {"99999999999.", 99999999999.0}};
  for (const auto& [text, value] : numbers) {
    EXPECT_EQ(YamlFile(with(text)).number("key"), value) << text;
  }
  const YamlFile file(with("[ -1 , 2,\n    3 ] # three"));
  EXPECT_EQ(file.integers("key"), (std::vector<int>{-1, 2, 3}));
  EXPECT_EQ(file.integer("last", 2), 2);
  EXPECT_EQ(file.number("none"), std::nullopt);
  EXPECT_EQ(file.integer("none", 0), std::nullopt);
  EXPECT_EQ(file.keys(), (std::vector<std::string>{"first", "key", "last"}));
  EXPECT_TRUE(file.has("key"));
  EXPECT_FALSE(file.has("none"));
  for (const char* text : {"a # b: [ c", "99999999999", "it's at 99999999999, 'so"}) {
    EXPECT_EQ(YamlFile(with('"' + std::string(text) + '"')).text("key"), text);
  }
  EXPECT_EQ(YamlFile(write("%YAML:1.0\nother: 1\n...\n---\nkey: 7\n")).number("key"), 7)
      << "a second document";
}

TEST_F(YamlFileTest, ErrorsNameFileKeyValueAndExpectation) {
  const auto number = [](const YamlFile& file) { file.number("key"); };
  const auto count = [](const YamlFile& file) { file.integer("key", 0); };
  const auto list = [](const YamlFile& file) { file.integers("key"); };
  const auto text = [](const YamlFile& file) { file.text("key"); };
  const struct {
    void (*read)(const YamlFile&);
    const char *value, *message;
  } cases[] = {
      {number, "\"3\"", "key: got \"3\"; want a finite number"},
      {number, "{ a: 1 }", "key: got a map; want a finite number"},
      {number, ".Inf", "want a finite number"},
      {number, "99999999999", "got inf; want a finite number"},
      {number, "-2147483649 # wraps", "got -inf; want a finite number"},
      {count, "0x100000001", "got inf; want a whole number"},
      {count, "99999999999999999999", "got inf; want a whole number"},
      {count, "3.5", "key: got 3.5; want a whole number of at least 0"},
      {count, "-1", "key: got -1; want a whole number of at least 0"},
      {count, "[ 3 ]", "key: got a list; want a whole number"},
      {list, "3", "key: got 3; want a list of whole numbers, as [ 0, 16 ]"},
      {list, "[ 1,4294967297]", "key: got inf in it; want a list of whole numbers"},
      {list, "[ 1, 2.5 ]", "key: got 2.5 in it; want a list of whole numbers"},
      {text, "10", "key: got 10; want a text in quotes"},
      {text, "1\nkey: 2", "key: got the key twice; want it once"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.value);
    const auto path = with(c.value);
    const YamlFile file(path);
    expect_failure([&] { c.read(file); }, path.string() + ": key: got ");
    expect_failure([&] { c.read(file); }, c.message);
  }
}

TEST_F(YamlFileTest, RefusesFilesThatAreNotYaml) {
  const std::pair<std::string, const char*> cases[] = {
      {"", "is no OpenCV YAML file"},
      {"key: 3\n", "whose first line is %YAML:1.0"},
      {"<?xml version=\"1.0\"?><opencv_storage><key>3</key></opencv_storage>", "is no OpenCV"},
      {"%YAML:1.0\nkey: 3\nkey\n", "line 3: Missing ':'"},
      {"%YAML:1.0\nkey: 1,5\n", "line 2: "},
  };
  for (const auto& [text, message] : cases) {
    SCOPED_TRACE(text);
    const auto path = write(text);
    expect_failure([&] { YamlFile file(path); }, path.string() + ": ");
    expect_failure([&] { YamlFile file(path); }, message);
  }
}

/// OpenCV's parser recurses: each of these overflowed the stack.
TEST_F(YamlFileTest, RefusesDeepNesting) {
  for (const std::string level : {"[ ", "{ a: ", "{\n a:\n ", "- ", "a: "}) {
    SCOPED_TRACE(level);
    std::string deep = level == "- " ? "\n " : "";
    for (int k = 0; k < 100000; ++k) deep += level;
    const auto path = with(deep + "1");
    expect_failure([&] { YamlFile file(path); }, "may nest more than 1000");
  }
  EXPECT_EQ(YamlFile(with("3\n#" + std::string(2000, '-') + "\nother: 4")).number("key"), 3);
}

// --- Table of frames -----------------------------------------------------------------------------

std::ptrdiff_t cells_of(const std::string& row) {
  return std::count(row.begin(), row.end(), ',') + 1;
}

TEST(FrameTable, HasACellForEachColumnInTheirOrder) {
  FrameStatistics statistics;
  statistics.has_segmentation = true;
  statistics.segmentation_age_s = 0.25;
  statistics.features = 100;
  statistics.masked = 20;
  statistics.compensated = 10;
  statistics.moving = 5;
  statistics.custom = 4;
  statistics.restored = 3;
  statistics.starved = true;
  statistics.suggested_features = 1500;
  statistics.instances.resize(4);
  statistics.instances[0].compensation = Compensation::no_depth_image;
  statistics.instances[1].compensation = Compensation::too_few_samples;
  statistics.instances[2].compensation = Compensation::no_depth_image;
  statistics.instances[3].compensation = Compensation::cautious;
  statistics.motion.outcome = MotionOutcome::applied;
  statistics.motion.kept_still = 2;
  const std::string row = detail::frame_cells("7", 1.5, statistics);
  EXPECT_EQ(row, "7,1.500000,1,0.250000,4,100,20,10,5,4,3," + std::to_string(statistics.kept()) +
                     ",1,1500,2,1,1,applied,2");
  EXPECT_EQ(cells_of(row), cells_of(detail::frame_columns()));
}

}  // namespace
}  // namespace dynfilter::testing
