// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "yaml_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#include "io/regular_file.hpp"

namespace dynfilter::detail {
namespace {

namespace fs = std::filesystem;

constexpr const char* no_yaml = "is no OpenCV YAML file, whose first line is %YAML:1.0";
constexpr const char* digits = "0123456789";

std::string bytes_of(const fs::path& path) {
  require_regular_file(path);
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(stream), {});
  if (!stream.is_open() || stream.bad()) throw_file_error(path, "cannot be read");
  return bytes;
}

/// Returns the parser's complaint, such as "(12): Missing ':'", with the line number in words.
/// OpenCV stores it in place of the function's name.
std::string complaint_of(const cv::Exception& error) {
  for (const std::string& text : {error.func, error.err}) {
    const std::size_t end = text.find(')');
    if (text.compare(0, 1, "(") == 0 && end != std::string::npos) {
      return "line " + text.substr(1, end - 1) + text.substr(end + 1);
    }
  }
  return error.err;
}

/// Splits the text into lines without comments. It cuts at a '#' in quotes too, because texts are
/// not read from these lines.
std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  stream.exceptions(std::ios::badbit);  // a stream would swallow a failed allocation
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line.substr(0, line.find_first_of("#\r")));
  }
  return lines;
}

bool is_blank(const std::string& line) { return line.find_first_not_of(' ') == std::string::npos; }

/// Returns the line's indentation; its whole length if it is blank.
std::size_t indent_of(const std::string& line) {
  return std::min(line.find_first_not_of(' '), line.size());
}

/// Returns the position of the value in a line "<key>: <value>"; npos for other lines.
std::size_t value_position(const std::string& line, const std::string& key) {
  const std::size_t begin = indent_of(line);
  if (line.compare(begin, key.size(), key) != 0) return std::string::npos;
  const std::size_t colon = line.find_first_not_of(' ', begin + key.size());
  return colon != std::string::npos && line[colon] == ':' ? colon + 1 : std::string::npos;
}

std::string without_sign(const std::string& token) {
  return token.substr(token[0] == '-' || token[0] == '+' ? 1 : 0);
}

bool is_whole(const std::string& token) {
  const std::string magnitude = without_sign(token);
  return !magnitude.empty() && magnitude.find_first_not_of(digits) == std::string::npos;
}

/// Tells whether OpenCV would read the number as octal.
bool has_leading_zero(const std::string& token) {
  const std::string magnitude = without_sign(token);
  return is_whole(token) && magnitude.size() > 1 && magnitude[0] == '0';
}

std::string decimal_hint(const std::string& token) {
  return has_leading_zero(token) ? ", without leading zeros" : "";
}

/// Returns the token's whole number in decimal notation, if an int can hold it.
std::optional<int> parse_integer(const std::string& token) {
  if (!is_whole(token) || has_leading_zero(token)) return {};
  const std::optional<double> value = parse_number(token);  // exact where it fits an int
  if (!value || *value < std::numeric_limits<int>::min() ||
      *value > std::numeric_limits<int>::max()) {
    return {};
  }
  return static_cast<int>(*value);
}

/// Returns the token's number in decimal notation.
std::optional<double> parse_real(const std::string& token) {
  const bool is_decimal = token.find_first_not_of("0123456789.eE+-") == std::string::npos;
  return is_decimal ? parse_number(token) : std::nullopt;
}

bool is_infinity(const cv::FileNode& node, const std::string& token) {
  return node.isReal() && std::isinf(static_cast<double>(node)) &&
         token.find_first_of(digits) == std::string::npos;
}

/// Describes the content of a node that is no whole number, for messages.
std::string text_of(const cv::FileNode& node) {
  if (node.isReal()) return concatenate(static_cast<double>(node));
  if (node.isString()) return "\"" + static_cast<std::string>(node) + "\"";
  if (node.isSeq()) return "a list";
  if (node.isMap()) return "a map";
  return "nothing";
}

}  // namespace

YamlFile::YamlFile(std::filesystem::path path) : path_(std::move(path)) {
  const std::string bytes = bytes_of(path_);
  if (bytes.empty()) refuse(no_yaml + std::string(" (it is empty)"));
  // OpenCV would stop reading at a NUL.
  if (bytes.find('\0') != std::string::npos) refuse(no_yaml + std::string(" (it is no text)"));
  parse(bytes);
  lines_ = split_lines(bytes);
}

void YamlFile::parse(const std::string& text) {
  try {
    // Read from memory: in a path, FileStorage takes everything after a '?' for options.
    storage_.open(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    cv::FileNode root;
    for (int document = 0; !(root = storage_.root(document)).empty(); ++document) {
      if (!root.isMap()) continue;
      for (const cv::FileNode& node : root) {
        keys_.push_back(node.name());
        nodes_.emplace(node.name(), node);
      }
    }
  } catch (const cv::Exception& error) {
    refuse(no_yaml + std::string(" (") + complaint_of(error) + ")");
  }
}

const cv::FileNode* YamlFile::find(const std::string& key) const {
  const auto [begin, end] = nodes_.equal_range(key);
  const auto count = std::distance(begin, end);
  if (count > 1) refuse(key, concatenate("the key ", count, " times"), "it once");
  return count == 0 ? nullptr : &begin->second;
}

/// Returns the line that begins with the key. Indented keys of that name belong to blocks of the
/// host.
std::size_t YamlFile::line_of(const std::string& key) const {
  std::optional<std::size_t> found;
  bool is_unique = false;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    if (value_position(lines_[i], key) == std::string::npos) continue;
    const std::size_t indent = indent_of(lines_[i]);
    if (found && indent > indent_of(lines_[*found])) continue;
    is_unique = !found || indent < indent_of(lines_[*found]);
    found = i;
  }
  if (!is_unique) refuse(key, "it within a line, or twice", "it at the beginning of one line");
  return *found;
}

/// Splits the value into words: a number, or the elements of a list of numbers.
std::vector<std::string> YamlFile::tokens(const std::string& key) const {
  const std::size_t first = line_of(key);
  std::string value = lines_[first].substr(value_position(lines_[first], key));
  for (std::size_t i = first + 1; i < lines_.size(); ++i) {
    if (is_blank(lines_[i])) continue;
    if (indent_of(lines_[i]) <= indent_of(lines_[first])) break;
    value += ' ' + lines_[i];
  }
  for (const char sign : {'[', ']', ','}) std::replace(value.begin(), value.end(), sign, ' ');
  std::vector<std::string> words;
  std::istringstream stream(value);
  stream.exceptions(std::ios::badbit);  // a stream would swallow a failed allocation
  for (std::string word; stream >> word;) {
    const bool is_syntax = word == "-" || word[0] == '!';  // a block's element, a type's name
    if (!is_syntax) words.push_back(word);
  }
  return words;
}

std::string YamlFile::number_token(const std::string& key) const {
  const std::vector<std::string> words = tokens(key);
  if (words.size() != 1) refuse(key, concatenate(words.size(), " words"), "one number");
  return words[0];
}

std::string YamlFile::shown(const std::string& key) const {
  const cv::FileNode& node = *find(key);
  return node.isInt() || node.isReal() ? number_token(key) : text_of(node);
}

std::optional<double> YamlFile::number(const std::string& key) const {
  const cv::FileNode* node = find(key);
  if (node == nullptr) return {};
  if (!node->isInt() && !node->isReal()) refuse(key, text_of(*node), "a number");
  const std::string token = number_token(key);
  if (is_infinity(*node, token)) return static_cast<double>(*node);
  const std::optional<double> value = parse_real(token);
  if (!value || has_leading_zero(token)) {
    refuse(key, token, "a decimal number" + decimal_hint(token));
  }
  // The host would read a different number.
  if (is_whole(token) && !parse_integer(token)) {
    refuse(key, token, "a number that OpenCV can hold, " + token + ".0");
  }
  return value;
}

std::optional<int> YamlFile::integer(const std::string& key, int min_value) const {
  const cv::FileNode* node = find(key);
  if (node == nullptr) return {};
  const std::string token = shown(key);
  const std::optional<int> value = node->isInt() ? parse_integer(token) : std::nullopt;
  if (!value || *value < min_value) {
    refuse(key, token,
           concatenate("a whole number from ", min_value, " to ", std::numeric_limits<int>::max()) +
               decimal_hint(token));
  }
  return value;
}

std::optional<std::vector<int>> YamlFile::integers(const std::string& key) const {
  const cv::FileNode* node = find(key);
  if (node == nullptr) return {};
  const std::string want = "a list of whole numbers, as [ 0, 16 ]";
  if (!node->isSeq()) refuse(key, shown(key), want);
  for (const cv::FileNode& element : *node) {
    if (!element.isInt()) refuse(key, text_of(element) + " in it", want);
  }
  const std::vector<std::string> words = tokens(key);
  if (words.size() != node->size()) refuse(key, "a list in another notation", want);
  std::vector<int> values;
  for (const std::string& word : words) {
    const std::optional<int> value = parse_integer(word);
    if (!value) {
      refuse(key, word + " in it",
             concatenate(want, ", each at most ", std::numeric_limits<int>::max()) +
                 decimal_hint(word));
    }
    values.push_back(*value);
  }
  return values;
}

std::optional<std::string> YamlFile::text(const std::string& key, const std::string& want) const {
  const cv::FileNode* node = find(key);
  if (node == nullptr) return {};
  if (!node->isString()) refuse(key, shown(key), want);
  return static_cast<std::string>(*node);
}

void YamlFile::refuse(const std::string& key, const std::string& got,
                      const std::string& want) const {
  refuse(key + ": got " + got + "; want " + want);
}

void YamlFile::refuse(const std::string& what) const { throw_file_error(path_, what); }

}  // namespace dynfilter::detail
