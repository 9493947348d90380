// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a host has after a call of the plugin that failed.

#include "dynfilter/plugin.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "support/expect_error.hpp"
#include "support/failing_allocations.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

/// The parts of a frame that a filter may change.
struct HostColumns {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  int pivot = 100;

  explicit HostColumns(const HostFrame& frame)
      : keypoints(frame.keypoints), descriptors(frame.descriptors.clone()) {}
};

void expect_equal(const HostColumns& got, const HostColumns& want) {
  ASSERT_EQ(got.keypoints.size(), want.keypoints.size());
  for (std::size_t i = 0; i < got.keypoints.size(); ++i) {
    ASSERT_EQ(got.keypoints[i].class_id, want.keypoints[i].class_id);
    ASSERT_EQ(got.keypoints[i].pt, want.keypoints[i].pt);
  }
  ASSERT_EQ(got.descriptors.size(), want.descriptors.size());
  EXPECT_EQ(cv::norm(got.descriptors, want.descriptors, cv::NORM_L1), 0);
  EXPECT_EQ(got.pivot, want.pivot);
}

class PluginFailures : public PluginTest {
 protected:
  /// Lets every allocation of `filter(plugin, columns)` fail in turn, each time with a new plugin,
  /// and expects that the columns stay and that the next call does what an undisturbed one does.
  template <class Filter>
  void expect_all_or_nothing(const std::string& lines, const Filter& filter) {
    const HostFrame frame(0);
    HostColumns filtered(frame);
    {
      Plugin plugin(settings(lines));
      filter(plugin, filtered);
    }
    ASSERT_LT(filtered.keypoints.size(), frame.keypoints.size());
    const std::size_t failed = for_each_failing_allocation([&](const std::size_t n) {
      SCOPED_TRACE(n);
      Plugin plugin(settings(lines));
      HostColumns columns(frame);
      const cv::Mat shared = columns.descriptors;  // so that rows must move into a copy
      bool is_done = false;
      const bool one_failed = fails_at_allocation(n, [&] {
        try {
          filter(plugin, columns);
          is_done = true;
        } catch (const std::runtime_error& error) {  // an image whose decoding failed
          EXPECT_NE(std::string(error.what()).find("cannot be"), std::string::npos);
        }
      });
      if (!is_done) {
        expect_equal(columns, HostColumns(frame));
        EXPECT_EQ(plugin.counters().filtered, 0U);
        filter(plugin, columns);
      }
      expect_equal(columns, filtered);
      EXPECT_EQ(plugin.counters().filtered, 1U);
      return one_failed && !HasFailure();
    });
    EXPECT_GT(failed, 10U);
  }
};

TEST_F(PluginFailures, AFailedAllocationLeavesARgbdFrameAsItWas) {
  const HostFrame frame(0);
  expect_all_or_nothing("", [&](Plugin& plugin, HostColumns& columns) {
    plugin.filter(frame.timestamp_s, frame.depth, columns.keypoints, columns.descriptors);
    columns.pivot = 100;
  });
}

TEST_F(PluginFailures, AFailedAllocationLeavesThePivotOfAFisheyeImageAsItWas) {
  const HostFrame frame(0);
  expect_all_or_nothing("", [&](Plugin& plugin, HostColumns& columns) {
    plugin.filter(frame.timestamp_s, columns.keypoints, columns.descriptors, columns.pivot);
  });
}

TEST_F(PluginFailures, AFailedAllocationLeavesAFrameThatIsRecordedAsItWas) {
  const HostFrame frame(0);
  const std::string lines = "dynfilter.output_folder: \"" + path("out").string() + "\"\n";
  expect_all_or_nothing(lines, [&](Plugin& plugin, HostColumns& columns) {
    plugin.filter(frame.timestamp_s, columns.keypoints, columns.descriptors, columns.pivot);
  });
  std::ifstream table(path("out") / "frames.csv");
  int rows = -1;  // without the header
  for (std::string line; std::getline(table, line);) ++rows;
  EXPECT_EQ(rows, 1) << "a frame that failed has no line";
}

TEST_F(PluginFailures, AnOverlayThatCannotBeWrittenLeavesTheFrameAsItWas) {
  Plugin plugin(settings("dynfilter.output_folder: \"" + path("out").string() +
                         "\"\ndynfilter.overlay_every: 1\n"));
  fs::remove(path("out") / "overlays");
  const HostFrame frame(0);
  HostColumns columns(frame);
  plugin.submit(frame.image, frame.timestamp_s);
  const auto filter = [&] {
    plugin.filter(frame.timestamp_s, columns.keypoints, columns.descriptors, columns.pivot);
  };
  expect_error<std::runtime_error>(filter, "100.000000.png: cannot be written");
  expect_equal(columns, HostColumns(frame));

  fs::create_directory(path("out") / "overlays");
  filter();
  EXPECT_LT(columns.pivot, 100);
  EXPECT_TRUE(fs::exists(path("out") / "overlays" / "100.000000.png"));
}

}  // namespace
}  // namespace dynfilter::testing
