// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Readers that are not ours, for what we write for others.

#pragma once

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "support/test.hpp"

namespace dynfilter::testing {

/// Returns what neighbours.py prints, see there.
inline std::string read_by_others(const std::string& arguments) {
  const std::string command = "python3 '" DYNFILTER_SOURCE_DIR "/tests/support/neighbours.py' ";
  std::FILE* pipe = popen((command + arguments + " 2>&1").c_str(), "r");
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  EXPECT_EQ(pclose(pipe), 0) << text;
  return text;
}

/// A row of a list of ORB-SLAM's.
struct OrbSlamFrame {
  double time_s = 0, depth_time_s = 0;
  std::string image, depth;
};

/// Reads associations.txt as LoadImages of ORB-SLAM's rgbd_tum does: every line that is not empty
/// is a frame, without comments. The loader of mono_tum skips three lines of rgb.txt, which has no
/// depth.
inline std::vector<OrbSlamFrame> load_images(const std::string& list, int skipped_lines = 0) {
  std::vector<OrbSlamFrame> frames;
  std::ifstream file(list);
  std::string line;
  for (int k = 0; k < skipped_lines; ++k) std::getline(file, line);
  while (!file.eof()) {
    std::getline(file, line);
    if (line.empty()) continue;
    std::stringstream words;
    words << line;
    OrbSlamFrame& frame = frames.emplace_back();
    words >> frame.time_s >> frame.image >> frame.depth_time_s >> frame.depth;
  }
  return frames;
}

}  // namespace dynfilter::testing
