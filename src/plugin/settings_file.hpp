// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_SETTINGS_FILE_HPP
#define DYNFILTER_SRC_PLUGIN_SETTINGS_FILE_HPP

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "io/yaml_file.hpp"

namespace dynfilter::detail {

/// Reads the settings "<prefix>.*" of an OpenCV YAML file that also holds a host's settings. Each
/// read_… call declares a key; if the file has it, the call checks the value and replaces the
/// default. finish() refuses undeclared keys. All errors are std::runtime_error that name file and
/// key.
class SettingsFile {
 public:
  /// Opens the file. Throws if it cannot be read.
  SettingsFile(const std::string& path, const std::string& prefix);

  void read_text(const std::string& name, std::string& value);
  void read_choice(const std::string& name, const std::vector<std::string>& choices,
                   std::string& value);
  void read_flag(const std::string& name, bool& value);
  void read_number(const std::string& name, double& value);
  void read_count(const std::string& name, std::size_t& value);
  void read_count(const std::string& name, int& value);
  void read_integers(const std::string& name, std::vector<int>& values);

  /// Reads a number of the host, such as DepthMapFactor: finite, at least 0. Returns `value`
  /// without it.
  double host_number(const std::string& key, double value) const;

  /// Reads a number of the host of either sign, such as a distortion coefficient: finite. Returns
  /// nothing without it.
  std::optional<double> host_real(const std::string& key) const;

  /// Reads a text of the host, such as Camera.type; empty without it.
  std::string host_text(const std::string& key) const;

  /// Throws for a file without any dynfilter key, listing the keys, for an unknown key, naming the
  /// nearest known one, and for settings in a block "<prefix>:", which would be ignored.
  void finish() const;

  /// Tells whether the file has the setting.
  bool has(const std::string& name) const;

  /// Returns the whole key of a name: "dynfilter.margin_px" for "margin_px".
  std::string key_of(const std::string& name) const { return prefix_ + name; }

  [[noreturn]] void refuse(const std::string& name, const std::string& got,
                           const std::string& want) const;
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  /// Declares the name and returns its key.
  std::string declare(const std::string& name);
  bool is_known(const std::string& name) const;

  YamlFile file_;
  std::string prefix_;              // with its dot
  bool has_block_ = false;          // the file has settings in a block
  std::vector<std::string> names_;  // the file's keys, without prefix
  std::vector<std::string> known_;
  std::vector<std::string> misspelt_;  // keys whose prefix is nearly right, with it
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_SETTINGS_FILE_HPP
