// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_IO_YAML_FILE_HPP
#define DYNFILTER_SRC_IO_YAML_FILE_HPP

#include <cstddef>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::detail {

/// Reads top-level keys of an OpenCV YAML file strictly: a camera file, or a host's settings.
/// Judges only the keys that are asked for; a host may have any others.
///
/// cv::FileStorage says whether the file is YAML, which keys it has, and what its texts are. It
/// turns 5000000000 into 705032704 and 010 into 8, so numbers are read from the file's text.
///
/// All errors are std::runtime_error: "<path>: <what is wrong>", and for a wrong value
/// "<path>: <key>: got <value>; want <what is right>".
class YamlFile {
 public:
  /// Reads the file. Throws for one that is missing, not regular (a FIFO would block) or no YAML.
  explicit YamlFile(std::filesystem::path path);
  YamlFile(const YamlFile&) = delete;  // the nodes point to the storage
  YamlFile& operator=(const YamlFile&) = delete;

  /// Lists the top-level keys in the file's order; a key that is repeated is listed as often.
  const std::vector<std::string>& keys() const { return keys_; }

  /// Tells whether the key is there. Throws if it is repeated, as do all functions below.
  bool has(const std::string& key) const { return find(key) != nullptr; }

  /// Reads a number, which may be infinite and is not NaN; std::nullopt without the key.
  std::optional<double> number(const std::string& key) const;

  /// Reads a whole number of at least `lowest`; std::nullopt without the key.
  std::optional<int> integer(const std::string& key, int min_value) const;

  /// Reads a list of whole numbers; std::nullopt without the key.
  std::optional<std::vector<int>> integers(const std::string& key) const;

  /// Reads a text; std::nullopt without the key. `want` is for the error.
  std::optional<std::string> text(const std::string& key,
                                  const std::string& want = "a text in quotes") const;

  /// Shows what the key holds, for messages: numbers as the file writes them, texts in quotes. The
  /// key must be there.
  std::string shown(const std::string& key) const;

  [[noreturn]] void refuse(const std::string& key, const std::string& got,
                           const std::string& want) const;
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  const cv::FileNode* find(const std::string& key) const;  // null without the key
  void parse(const std::string& text);
  std::size_t line_of(const std::string& key) const;
  std::vector<std::string> tokens(const std::string& key) const;
  std::string number_token(const std::string& key) const;

  std::filesystem::path path_;
  cv::FileStorage storage_;
  std::vector<std::string> keys_;
  std::multimap<std::string, cv::FileNode> nodes_;  // by key
  std::vector<std::string> lines_;                  // of the file, without comments
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_YAML_FILE_HPP
