// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Reads top-level keys of an OpenCV YAML file: a camera file, or a host's settings. Checks only
/// the keys that are asked for. cv::FileStorage parses, so numbers are what the host reads: 010 is
/// 8; but what int does not hold is infinite, not wrapped. All errors are std::runtime_error:
/// "<path>: <what is wrong>", and for a wrong value
/// "<path>: <key>: got <value>; want <what is right>".
class YamlFile {
 public:
  /// Reads the file. Throws for one that is missing, not regular (a FIFO would block) or no YAML.
  explicit YamlFile(std::filesystem::path path);
  /// Lists the top-level keys in the file's order.
  std::vector<std::string> keys() const;
  /// Tells whether the key is there. Throws if it is repeated, as do all functions below.
  bool has(const std::string& key) const { return !find(key).empty(); }
  /// @{
  /// Reads a finite number, a whole number of at least `min_value`, a list of whole numbers, or a
  /// text (`want` is for the error); std::nullopt without the key.
  std::optional<double> number(const std::string& key) const;
  std::optional<int> integer(const std::string& key, int min_value) const;
  std::optional<std::vector<int>> integers(const std::string& key) const;
  std::optional<std::string> text(const std::string& key,
                                  const std::string& want = "a text in quotes") const;
  /// @}
  /// Shows what the key holds, for messages.
  std::string shown(const std::string& key) const;

  [[noreturn]] void refuse(const std::string& what) const;
  [[noreturn]] void refuse(const std::string& key, const std::string& got,
                           const std::string& want) const {
    refuse(key + ": got " + got + "; want " + want);
  }

 private:
  cv::FileNode find(const std::string& key) const;  // empty without the key

  std::filesystem::path path_;
  cv::FileStorage storage_;
  std::vector<std::pair<std::string, cv::FileNode>> nodes_;
};

}  // namespace dynfilter::detail
