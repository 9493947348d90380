// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "io/yaml_file.hpp"

namespace dynfilter::detail {

/// Reads the settings "<prefix>.*" of an OpenCV YAML file that also holds a host's settings. Each
/// read_… call declares a name; if the file has it, the call checks its type and replaces the
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
  void read_integers(const std::string& name, std::vector<int>& values);

  /// The whole file, for keys of the host.
  const YamlFile& host() const { return file_; }

  /// Throws for a file without any dynfilter key, listing the keys; for a key of an earlier
  /// version, saying what to do instead; for an unknown key, listing the keys; and for settings in
  /// a block "<prefix>:", which would be ignored.
  void finish() const;

  /// Returns the whole key of a name: "dynfilter.margin_px" for "margin_px".
  std::string key_of(const std::string& name) const { return prefix_ + name; }

  [[noreturn]] void refuse(const std::string& name, const std::string& got,
                           const std::string& want) const {
    file_.refuse(key_of(name), got, want);
  }

 private:
  /// Declares the name and returns its key.
  std::string declare(const std::string& name);
  void require_known(const std::string& name) const;

  YamlFile file_;
  std::string prefix_;  // with its dot
  std::vector<std::string> known_;
};

}  // namespace dynfilter::detail
