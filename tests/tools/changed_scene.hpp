// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Changes the files of a sequence, into what users have.

#pragma once

#include <regex>

#include "support/test.hpp"

namespace dynfilter::testing {

/// PNG files of a folder, by name.
inline std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".png") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

inline cv::Mat read_unchanged(const std::filesystem::path& file) {
  return cv::imread(file.string(), cv::IMREAD_UNCHANGED);
}

using ImageChange = std::function<cv::Mat(const cv::Mat&)>;

/// Replaces the images of a folder, in their order.
inline void change_images(const std::filesystem::path& folder, const ImageChange& change) {
  for (const auto& file : files_in(folder)) {
    cv::imwrite(file.string(), change(read_unchanged(file)));
  }
}

/// Replaces the text of a file.
inline void change_text(const std::filesystem::path& file,
                        const std::function<std::string(const std::string&)>& changed) {
  const std::string text = changed(file_text(file));
  std::ofstream(file, std::ios::binary) << text;
}

/// Replaces the line of a key in the camera file.
inline void set_camera(const std::filesystem::path& scene, const std::string& key,
                       const std::string& line) {
  change_text(scene / "camera.yaml", [&](const std::string& text) {
    return std::regex_replace(text, std::regex(key + ":[^\n]*"), line);
  });
}

}  // namespace dynfilter::testing
