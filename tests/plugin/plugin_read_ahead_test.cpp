// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Masks of a folder are read in a thread from submit on. That changes nothing but the time.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dynfilter/plugin.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

class PluginReadAhead : public PluginTest {
 protected:
  // The thread sanitizer does not see how OpenCV's own threads wait for each other.
  PluginReadAhead() { cv::setNumThreads(1); }

  /// Message of the error with which a frame is filtered.
  static std::string error_of(Plugin& plugin, int index) {
    try {
      kept(plugin, index);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(PluginReadAhead, DoesNotReadAMaskAgain) {
  const fs::path file = masks() / "100.000000.png", aside = file.string() + ".aside";
  bool was_read_once = false;
  for (int wait_ms = 1; wait_ms < 5000 && !was_read_once; wait_ms *= 2) {
    Plugin plugin(settings());
    submit(plugin, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    fs::rename(file, aside);
    was_read_once = error_of(plugin, 0) == "no error";
    fs::rename(aside, file);
  }
  EXPECT_TRUE(was_read_once);
}

TEST_F(PluginReadAhead, FollowsTheHostsOrderOfCalls) {
  Plugin plugin(settings()), behind(settings());    // to which nothing is submitted
  for (const int i : {0, 4, 2}) submit(plugin, i);  // two are never filtered
  EXPECT_EQ(kept(plugin, 2), kept(behind, 2));
  EXPECT_EQ(kept(plugin, 2), kept(behind, 2)) << "a second time";
  EXPECT_EQ(kept(plugin, 0), kept(behind, 0)) << "an earlier frame";
  submit(plugin, 1);
  EXPECT_EQ(kept(plugin, 5), kept(behind, 5)) << "not the one submitted";
  EXPECT_EQ(kept(plugin, 1), kept(behind, 1));
  HostFrame frame(3);  // its mask lies within max_time_difference_s of either time
  plugin.submit(frame.image, frame.timestamp_s - 0.0004);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s + 0.0004, frame.depth, frame.keypoints, frame.descriptors);
  EXPECT_GT(statistics.masked, 0U);
  EXPECT_EQ(statistics.segmentation_age_s, 0);
}

TEST_F(PluginReadAhead, ErrorsComeOutAtFilter) {
  fs::remove(masks() / "instances.csv");  // it would miss the mask itself
  fs::remove(masks() / "100.100000.png");
  std::ofstream(masks() / "100.200000.png") << "no image";
  Plugin plugin(settings());
  for (const int i : {1, 2}) submit(plugin, i);  // nobody filters the first
  const std::string broken = error_of(plugin, 2);
  EXPECT_NE(broken.find("100.200000.png: cannot be decoded"), std::string::npos) << broken;
  EXPECT_EQ(error_of(plugin, 2), broken) << "it stays broken";
  submit(plugin, 1);
  const std::string missing = error_of(plugin, 1);
  EXPECT_NE(missing.find("100.100000.png: there is no such mask"), std::string::npos) << missing;
  submit(plugin, 3);
  EXPECT_LT(kept(plugin, 3).size(), HostFrame(3).keypoints.size()) << "the next frame works";
}

TEST_F(PluginReadAhead, EndsAtAnyMoment) {
  for (int i = 0; i < 40; ++i) {
    Plugin plugin(settings());
    for (int k = 0; k <= i % frames; ++k) submit(plugin, k);
    if (i % 2 == 0) kept(plugin, i % frames);
    Plugin moved = std::move(plugin);
    submit(moved, i % frames);
  }
}

TEST_F(PluginReadAhead, FramesCsvSaysTheTimes) {
  Plugin plugin(settings("dynfilter.missing_masks: \"keep\"\ndynfilter.output_folder: \"" +
                         path("out").string() + "\"\n"));
  for (const int i : {0, 1, frames}) {  // the last has no mask
    submit(plugin, i);
    kept(plugin, i);
  }
  std::ifstream table(path("out") / "frames.csv");
  std::string header, row;
  std::getline(table, header);
  const std::string columns = ",masks_made_ms,masks_ms,filter_ms";
  ASSERT_EQ(header.substr(header.size() - columns.size()), columns);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(std::getline(table, row));
    std::vector<std::string> cells;
    std::istringstream stream(row);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    ASSERT_GE(cells.size(), 3U);
    EXPECT_EQ(cells[cells.size() - 3].empty(), i == 2) << row;
    const double masks_ms = std::stod(cells[cells.size() - 2]);
    EXPECT_GE(masks_ms, 0);
    EXPECT_GE(std::stod(cells.back()), masks_ms) << "filter waits for the masks";
  }
}

}  // namespace
}  // namespace dynfilter::testing
