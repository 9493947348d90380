// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/settings_file.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>

namespace dynfilter::detail {
namespace {

/// Returns today's name of a setting of version 0.1: min_ and max_ have replaced least_ and most_.
std::string present_name(std::string name) {
  const std::size_t word = name.rfind('.') + 1;  // 0 without a dot
  for (const auto& [old_prefix, prefix] :
       {std::pair("least_", "min_"), std::pair("most_", "max_")}) {
    if (name.rfind(old_prefix, word) == word) name.replace(word, std::strlen(old_prefix), prefix);
  }
  return name;
}

/// Returns Levenshtein's distance: the letters to change, add or remove.
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

/// Whether a key begins with the prefix in other letters, or with another character in place of the
/// dot behind it.
bool has_misspelt_prefix(const std::string& key, const std::string& prefix) {
  if (key.size() <= prefix.size()) return false;
  const auto is_same_letter = [](unsigned char a, unsigned char b) {
    return std::tolower(a) == std::tolower(b);
  };
  const bool begins = std::equal(prefix.begin(), prefix.end(), key.begin(), is_same_letter);
  const char separator = key[prefix.size()];
  const bool is_separated = separator == '.' || separator == '_' || separator == '-';
  return begins && is_separated && key.compare(0, prefix.size() + 1, prefix + ".") != 0;
}

std::string join(const std::vector<std::string>& words, const std::string& prefix = {}) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + prefix + word;
  return text;
}

/// Returns the name that is likeliest meant: one that begins with this and a dot, or the nearest.
std::string nearest_of(const std::vector<std::string>& names, const std::string& name) {
  const auto is_part = [&name](const std::string& other) {
    return other.compare(0, name.size() + 1, name + ".") == 0;
  };
  const auto longer = std::find_if(names.begin(), names.end(), is_part);
  if (longer != names.end()) return *longer;
  return *std::min_element(names.begin(), names.end(),
                           [&](const std::string& a, const std::string& b) {
                             return edit_distance(a, name) < edit_distance(b, name);
                           });
}

}  // namespace

SettingsFile::SettingsFile(const std::string& path, const std::string& prefix)
    : file_(path), prefix_(prefix + ".") {
  for (const std::string& key : file_.keys()) {
    if (key.compare(0, prefix_.size(), prefix_) == 0) names_.push_back(key.substr(prefix_.size()));
    if (key == prefix) has_block_ = true;
    if (has_misspelt_prefix(key, prefix)) misspelt_.push_back(key);
  }
}

std::string SettingsFile::declare(const std::string& name) {
  known_.push_back(name);
  return key_of(name);
}

void SettingsFile::read_text(const std::string& name, std::string& value) {
  value = file_.text(declare(name)).value_or(value);
}

void SettingsFile::read_choice(const std::string& name, const std::vector<std::string>& choices,
                               std::string& value) {
  const std::string want = "one of " + join(choices);
  const std::optional<std::string> text = file_.text(declare(name), want);
  if (!text) return;
  if (std::find(choices.begin(), choices.end(), *text) == choices.end()) {
    refuse(name, "\"" + *text + "\"", want);
  }
  value = *text;
}

void SettingsFile::read_flag(const std::string& name, bool& value) {
  if (!file_.has(declare(name))) return;
  const std::string shown = file_.shown(key_of(name));
  if (shown != "0" && shown != "1") refuse(name, shown, "0 or 1");
  value = shown == "1";
}

void SettingsFile::read_number(const std::string& name, double& value) {
  value = file_.number(declare(name)).value_or(value);
}

void SettingsFile::read_count(const std::string& name, int& value) {
  value = file_.integer(declare(name), 0).value_or(value);
}

void SettingsFile::read_count(const std::string& name, std::size_t& value) {
  const std::optional<int> number = file_.integer(declare(name), 0);
  if (number) value = static_cast<std::size_t>(*number);
}

void SettingsFile::read_integers(const std::string& name, std::vector<int>& values) {
  values = file_.integers(declare(name)).value_or(values);
}

double SettingsFile::host_number(const std::string& key, double value) const {
  const std::optional<double> number = file_.number(key);
  if (number && !(*number >= 0 && std::isfinite(*number))) {
    file_.refuse(key, file_.shown(key), "a finite number of at least 0");
  }
  return number.value_or(value);
}

std::optional<double> SettingsFile::host_real(const std::string& key) const {
  const std::optional<double> number = file_.number(key);
  if (number && !std::isfinite(*number)) file_.refuse(key, file_.shown(key), "a finite number");
  return number;
}

std::string SettingsFile::host_text(const std::string& key) const {
  return file_.text(key).value_or("");
}

bool SettingsFile::has(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

bool SettingsFile::is_known(const std::string& name) const {
  return std::find(known_.begin(), known_.end(), name) != known_.end();
}

void SettingsFile::finish() const {
  if (has_block_) {
    file_.refuse(prefix_.substr(0, prefix_.size() - 1), "settings in a block",
                 "each in a line of its own, as " + key_of("mask_folder") + ": \"masks\"");
  }
  for (const std::string& key : misspelt_) {
    const std::string name = key.substr(prefix_.size());
    if (is_known(name)) refuse("has the key " + key + "; want " + key_of(name));
  }
  if (names_.empty()) {
    refuse("has no setting of dynfilter. Add at least\n  " + key_of("mask_folder") +
           ": \"masks\"\nor, to run without the filter,\n  " + key_of("enabled") +
           ": 0\nThe settings are: " + join(known_, prefix_));
  }
  for (const std::string& name : names_) {
    if (is_known(name)) continue;
    if (is_known(present_name(name))) {
      refuse("the setting " + key_of(name) + " is called " + key_of(present_name(name)) + " now");
    }
    refuse("there is no setting " + key_of(name) + "; the nearest is " +
           key_of(nearest_of(known_, name)));
  }
}

void SettingsFile::refuse(const std::string& name, const std::string& got,
                          const std::string& want) const {
  file_.refuse(key_of(name), got, want);
}

void SettingsFile::refuse(const std::string& what) const { file_.refuse(what); }

}  // namespace dynfilter::detail
