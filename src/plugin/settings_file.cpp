// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/settings_file.hpp"

#include <algorithm>
#include <fstream>
#include <numeric>
#include <stdexcept>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {
namespace {

/// Levenshtein's distance: how many letters must be changed, added or taken away.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// What a node holds, for messages.
std::string text_of(const cv::FileNode& node) {
  if (node.isInt()) return std::to_string(static_cast<int>(node));
  if (node.isReal()) return concatenate(static_cast<double>(node));
  if (node.isString()) return "\"" + static_cast<std::string>(node) + "\"";
  if (node.isSeq()) return "a list";
  if (node.isMap()) return "a map";
  return "nothing";
}

std::string join(const std::vector<std::string>& words, const std::string& prefix = {}) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + prefix + word;
  return text;
}

}  // namespace

SettingsFile::SettingsFile(const std::string& path, const std::string& prefix)
    : path_(path), prefix_(prefix + ".") {
  // cv::FileStorage prints about a file that is not there.
  if (!std::ifstream(path)) refuse("cannot be read");
  try {
    storage_.open(path, cv::FileStorage::READ);
    for (const cv::FileNode& node : storage_.root()) {
      const std::string key = node.name();
      if (key.compare(0, prefix_.size(), prefix_) == 0) nodes_[key.substr(prefix_.size())] = node;
    }
  } catch (const cv::Exception& error) {
    refuse("is no YAML file of OpenCV's: " + error.err);
  }
}

const cv::FileNode* SettingsFile::find(const std::string& name) {
  known_.push_back(name);
  const auto node = nodes_.find(name);
  return node == nodes_.end() ? nullptr : &node->second;
}

void SettingsFile::read_text(const std::string& name, std::string& value) {
  const cv::FileNode* node = find(name);
  if (node == nullptr) return;
  if (!node->isString()) refuse(name, text_of(*node), "a text in quotes");
  value = static_cast<std::string>(*node);
}

void SettingsFile::read_choice(const std::string& name, const std::vector<std::string>& choices,
                               std::string& value) {
  const cv::FileNode* node = find(name);
  if (node == nullptr) return;
  const std::string text = node->isString() ? static_cast<std::string>(*node) : std::string();
  if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
    refuse(name, text_of(*node), "one of " + join(choices));
  }
  value = text;
}

void SettingsFile::read_number(const std::string& name, double& value) {
  const cv::FileNode* node = find(name);
  if (node == nullptr) return;
  if (!node->isInt() && !node->isReal()) refuse(name, text_of(*node), "a number");
  value = static_cast<double>(*node);
}

void SettingsFile::read_count(const std::string& name, int& value) {
  const cv::FileNode* node = find(name);
  if (node == nullptr) return;
  const int number = node->isInt() ? static_cast<int>(*node) : -1;
  if (number < 0) refuse(name, text_of(*node), "a whole number of at least 0");
  value = number;
}

void SettingsFile::read_count(const std::string& name, std::size_t& value) {
  int number = -1;
  read_count(name, number);
  if (number >= 0) value = static_cast<std::size_t>(number);
}

void SettingsFile::read_integers(const std::string& name, std::vector<int>& values) {
  const cv::FileNode* node = find(name);
  if (node == nullptr) return;
  const char* want = "a list of whole numbers, as [ 0, 16 ]";
  if (!node->isSeq()) refuse(name, text_of(*node), want);
  std::vector<int> read;
  for (const cv::FileNode& element : *node) {
    if (!element.isInt()) refuse(name, text_of(element) + " in it", want);
    read.push_back(static_cast<int>(element));
  }
  values = read;
}

double SettingsFile::foreign_number(const std::string& key) const {
  const cv::FileNode node = storage_[key];
  return node.isInt() || node.isReal() ? static_cast<double>(node) : 0.0;
}

void SettingsFile::finish() const {
  if (nodes_.empty()) {
    refuse("has no setting of dynfilter. Add at least\n  " + prefix_ +
           "mask_folder: \"masks\"\nThere are: " + join(known_, prefix_));
  }
  for (const auto& [name, node] : nodes_) {
    if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
    const auto nearest = std::min_element(
        known_.begin(), known_.end(), [&wanted = name](const std::string& a, const std::string& b) {
          return edit_distance(a, wanted) < edit_distance(b, wanted);
        });
    refuse("there is no setting " + prefix_ + name + "; the nearest is " + prefix_ + *nearest);
  }
}

void SettingsFile::refuse(const std::string& name, const std::string& got,
                          const std::string& want) const {
  refuse(prefix_ + name + ": got " + got + "; want " + want);
}

void SettingsFile::refuse(const std::string& what) const {
  throw std::runtime_error(path_ + ": " + what);
}

}  // namespace dynfilter::detail
