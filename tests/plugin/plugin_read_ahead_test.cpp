// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The setting read_ahead changes when masks are read, and nothing else.

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "dynfilter/plugin.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* both[] = {"dynfilter.read_ahead: 1\n", "dynfilter.read_ahead: 0\n"};

class PluginReadAhead : public PluginTest {
 protected:
  // The thread sanitizer does not see how OpenCV's own threads wait for each other.
  PluginReadAhead() { cv::setNumThreads(1); }

  /// Filters a frame; returns the class ids of the keypoints that are left.
  static std::vector<int> kept(Plugin& plugin, int index) {
    HostFrame frame(index);
    plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
    EXPECT_TRUE(in_step(frame));
    std::vector<int> left;
    for (const cv::KeyPoint& keypoint : frame.keypoints) left.push_back(keypoint.class_id);
    return left;
  }

  static void submit(Plugin& plugin, int index) {
    const HostFrame frame(index);
    plugin.submit(frame.image, frame.timestamp_s);
  }

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

TEST_F(PluginReadAhead, GivesTheSameFeatures) {
  Plugin ahead(settings(both[0])), behind(settings(both[1])), by_default(settings());
  for (int i = 0; i < frames; ++i) {
    const bool is_submitted = i != 3;
    for (Plugin* plugin : {&ahead, &behind, &by_default}) {
      if (is_submitted) submit(*plugin, i);
    }
    const std::vector<int> want = kept(behind, i);
    EXPECT_LT(want.size(), HostFrame(i).keypoints.size());
    EXPECT_EQ(kept(ahead, i), want) << i;
    EXPECT_EQ(kept(ahead, i), want) << i << ", a second time";
    EXPECT_EQ(kept(by_default, i), want) << i;
  }
  EXPECT_EQ(by_default.counters().without_masks, 0U);
  EXPECT_EQ(by_default.counters().never_submitted, 1U);
}

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
  Plugin plugin(settings()), behind(settings(both[1]));
  for (const int i : {0, 4, 2}) submit(plugin, i);  // two are never filtered
  EXPECT_EQ(kept(plugin, 2), kept(behind, 2));
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
  std::string missing, broken;
  for (const char* read_ahead : both) {
    SCOPED_TRACE(read_ahead);
    Plugin plugin(settings(read_ahead));
    for (const int i : {1, 2}) submit(plugin, i);  // nobody filters the first
    const std::string as_broken = error_of(plugin, 2);
    EXPECT_NE(as_broken.find("100.200000.png: cannot be decoded"), std::string::npos) << as_broken;
    EXPECT_EQ(error_of(plugin, 2), as_broken) << "it stays broken";
    submit(plugin, 1);
    const std::string as_missing = error_of(plugin, 1);
    EXPECT_NE(as_missing.find("100.100000.png: there is no such mask"), std::string::npos);
    EXPECT_TRUE(missing.empty() || as_missing == missing) << as_missing;
    EXPECT_TRUE(broken.empty() || as_broken == broken) << as_broken;
    missing = as_missing;
    broken = as_broken;
    submit(plugin, 3);
    EXPECT_LT(kept(plugin, 3).size(), HostFrame(3).keypoints.size()) << "the next frame works";

    Plugin lenient(settings(std::string(read_ahead) + "dynfilter.missing_masks: \"keep\"\n"));
    submit(lenient, 1);
    EXPECT_EQ(kept(lenient, 1).size(), HostFrame(1).keypoints.size());
    EXPECT_EQ(lenient.counters().without_masks, 1U);
    submit(lenient, 2);
    EXPECT_EQ(error_of(lenient, 2), broken) << "a broken mask is always an error";
  }
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
  for (const char* read_ahead : both) {
    Plugin plugin(settings(std::string(read_ahead) + "dynfilter.missing_masks: \"keep\"\n" +
                           "dynfilter.output_folder: \"" + path("out").string() + "\"\n"));
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
      const std::string& made = cells[cells.size() - 3];
      EXPECT_EQ(made.empty(), i == 2) << row;
      const double masks_ms = std::stod(cells[cells.size() - 2]);
      EXPECT_GE(masks_ms, 0);
      EXPECT_GE(std::stod(cells.back()), masks_ms) << "filter waits for the masks";
      const bool is_within = i < 2 && std::string(read_ahead) == both[1];
      if (!is_within) continue;
      EXPECT_GE(masks_ms + 0.001, std::stod(made)) << "filter reads them itself";
    }
  }
}

TEST_F(PluginReadAhead, RefusesAnotherValue) {
  expect_error<std::runtime_error>([&] { Plugin plugin(settings("dynfilter.read_ahead: 2\n")); },
                                   "dynfilter.read_ahead: got 2; want 0 or 1");
}

}  // namespace
}  // namespace dynfilter::testing
