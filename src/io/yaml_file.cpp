// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "yaml_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include "dynfilter/detail/errors.hpp"
#include "io/file_error.hpp"

namespace dynfilter::detail {
namespace {

std::string text_of(const cv::FileNode& node) {
  if (node.isInt()) return concatenate(static_cast<int>(node));
  if (node.isReal()) return concatenate(static_cast<double>(node));
  if (node.isString()) return "\"" + static_cast<std::string>(node) + "\"";
  return node.isSeq() ? "a list" : node.isMap() ? "a map" : "nothing";
}

/// Deeper nesting of lists and maps may overflow the stack of OpenCV's parser.
constexpr std::ptrdiff_t max_nesting = 1000;

/// Tells whether a text may nest deeper: by brackets, or by maps and lists that begin in one line.
bool may_nest_deeply(const std::string& text) {
  std::istringstream lines(text);
  std::ptrdiff_t brackets = 0, others = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line[std::min(line.find_first_not_of(" \t"), line.size())] == '#') continue;
    brackets +=
        std::count(line.begin(), line.end(), '[') + std::count(line.begin(), line.end(), '{');
    others = std::max(others, std::count(line.begin(), line.end(), ':') +
                                  std::count(line.begin(), line.end(), '-'));
  }
  return std::max(brackets, others) > max_nesting;
}

/// Makes whole numbers infinite that int does not hold, because OpenCV would wrap them.
std::string without_wrapped_numbers(const std::string& text) {
  using Ints = std::numeric_limits<int>;
  std::string read;
  char quote = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" \t\r\n,:[]{}\"'", begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    char* rest = nullptr;
    const long long value = std::strtoll(word.c_str(), &rest, 0);  // saturates
    const bool is_wide = *rest == 0 && (value < Ints::min() || value > Ints::max());
    read += !is_wide || quote != 0 ? word : value < 0 ? "-.Inf" : ".Inf";
    begin = end + 1;
    if (end == text.size()) break;
    read += text[end];
    const bool is_mark = text[end] == '"' || text[end] == '\'';
    if (text[end] == '\n' || text[end] == quote) {
      quote = 0;
    } else if (is_mark && quote == 0) {
      quote = text[end];
    }
  }
  return read;
}

}  // namespace

std::string YamlFile::shown(const std::string& key) const { return text_of(find(key)); }

YamlFile::YamlFile(std::filesystem::path path) : path_(std::move(path)) {
  require_regular_file(path_);
  std::ifstream stream(path_, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  if (!stream.is_open() || stream.bad()) refuse("cannot be read");
  const char* const want = "is no OpenCV YAML file, whose first line is %YAML:1.0";
  if (bytes.find("%YAML") > 3) refuse(want);  // neither XML nor JSON, which nest otherwise
  if (may_nest_deeply(bytes)) {
    refuse(concatenate("may nest more than ", max_nesting, " lists and maps; want settings"));
  }
  try {
    // Read from memory: in a path, FileStorage takes everything after a '?' for options.
    storage_.open(without_wrapped_numbers(bytes), cv::FileStorage::READ | cv::FileStorage::MEMORY);
    cv::FileNode root;
    for (int document = 0; !(root = storage_.root(document)).empty(); ++document) {
      if (!root.isMap()) continue;
      for (const cv::FileNode& node : root) nodes_.emplace_back(node.name(), node);
    }
  } catch (const cv::Exception& error) {
    // For a syntax error, OpenCV stores "(line): what is wrong" in place of the function's name.
    std::string what = error.func;
    const std::size_t end = what.find(')');
    if (what.compare(0, 1, "(") == 0 && end != std::string::npos) {
      what = "line " + what.substr(1, end - 1) + what.substr(end + 1);
    } else {
      what = error.err;
    }
    refuse(std::string(want) + " (" + what + ")");
  }
}

std::vector<std::string> YamlFile::keys() const {
  std::vector<std::string> keys;
  for (const auto& [key, node] : nodes_) keys.push_back(key);
  return keys;
}

cv::FileNode YamlFile::find(const std::string& key) const {
  cv::FileNode found;
  for (const auto& [name, node] : nodes_) {
    if (name != key) continue;
    if (!found.empty()) refuse(key, "the key twice", "it once");
    found = node;
  }
  return found;
}

std::optional<double> YamlFile::number(const std::string& key) const {
  const cv::FileNode node = find(key);
  if (node.empty()) return {};
  const bool is_number = node.isInt() || node.isReal();
  if (is_number && std::isfinite(static_cast<double>(node))) return static_cast<double>(node);
  refuse(key, text_of(node), "a finite number");
}

std::optional<int> YamlFile::integer(const std::string& key, int min_value) const {
  const cv::FileNode node = find(key);
  if (node.empty()) return {};
  if (node.isInt() && static_cast<int>(node) >= min_value) return static_cast<int>(node);
  refuse(key, text_of(node), concatenate("a whole number of at least ", min_value));
}

std::optional<std::vector<int>> YamlFile::integers(const std::string& key) const {
  const cv::FileNode node = find(key);
  if (node.empty()) return {};
  const std::string want = "a list of whole numbers, as [ 0, 16 ]";
  if (!node.isSeq()) refuse(key, text_of(node), want);
  std::vector<int> values;
  for (const cv::FileNode& element : node) {
    if (!element.isInt()) refuse(key, text_of(element) + " in it", want);
    values.push_back(static_cast<int>(element));
  }
  return values;
}

std::optional<std::string> YamlFile::text(const std::string& key, const std::string& want) const {
  const cv::FileNode node = find(key);
  if (node.isString()) return static_cast<std::string>(node);
  if (node.empty()) return {};
  refuse(key, text_of(node), want);
}

void YamlFile::refuse(const std::string& what) const { throw_file_error(path_, what); }

}  // namespace dynfilter::detail
