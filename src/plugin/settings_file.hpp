// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_SETTINGS_FILE_HPP
#define DYNFILTER_SRC_PLUGIN_SETTINGS_FILE_HPP

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// The settings "<prefix>.*" in an OpenCV YAML file that holds others besides. Each read_… call
/// makes a key known, and where the file has it checks it and replaces the value, which is the
/// default. finish() refuses the keys that nobody asked for. All errors are std::runtime_error that
/// name file and key.
class SettingsFile {
 public:
  SettingsFile(const std::string& path, const std::string& prefix);

  void read_text(const std::string& name, std::string& value);
  void read_choice(const std::string& name, const std::vector<std::string>& choices,
                   std::string& value);
  void read_number(const std::string& name, double& value);
  void read_count(const std::string& name, std::size_t& value);
  void read_count(const std::string& name, int& value);
  void read_integers(const std::string& name, std::vector<int>& values);

  /// A number of the file's that is not ours, such as DepthMapFactor; 0 if it is not there.
  double foreign_number(const std::string& key) const;

  /// Throws for a file without any key of ours, which it lists, and for unknown keys, with the
  /// nearest known one.
  void finish() const;

  [[noreturn]] void refuse(const std::string& name, const std::string& got,
                           const std::string& want) const;
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  /// The key's node, null if the file does not have it.
  const cv::FileNode* find(const std::string& name);

  std::string path_;
  std::string prefix_;  // with its dot
  cv::FileStorage storage_;
  std::map<std::string, cv::FileNode> nodes_;  // by name without prefix
  std::vector<std::string> known_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_SETTINGS_FILE_HPP
