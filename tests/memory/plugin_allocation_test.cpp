// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A host's frame is unchanged if an allocation fails inside Plugin::filter, and the next call is
// right.

#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/plugin.hpp"
#include "support/failing_allocations.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

using PluginAllocations = PluginTest;

TEST_F(PluginAllocations, FailedOneLeavesTheFrameUnchanged) {
  const HostFrame frame(0);
  HostColumns filtered(frame);
  Plugin(settings())
      .filter(frame.timestamp_s, frame.depth, filtered.keypoints, filtered.descriptors);
  ASSERT_LT(filtered.keypoints.size(), frame.keypoints.size());
  const std::size_t failed = for_each_failing_allocation([&](const std::size_t n) {
    SCOPED_TRACE(n);
    Plugin plugin(settings());
    HostColumns columns(frame);
    const cv::Mat shared = columns.descriptors;  // a second header, so that rows move into a copy
    const auto filter = [&] {
      plugin.filter(frame.timestamp_s, frame.depth, columns.keypoints, columns.descriptors);
    };
    bool is_done = false;
    const bool one_failed = fails_at_allocation(n, [&] {
      try {
        filter();
        is_done = true;
      } catch (const std::runtime_error& error) {  // decoding of an image failed
        EXPECT_NE(std::string(error.what()).find("cannot be"), std::string::npos);
      }
    });
    if (!is_done) {
      expect_equal(columns, HostColumns(frame));
      EXPECT_EQ(plugin.counters().filtered, 0U);
      filter();
    }
    expect_equal(columns, filtered);
    EXPECT_EQ(plugin.counters().filtered, 1U);
    return one_failed && !HasFailure();
  });
  EXPECT_GT(failed, 10U);
}

}  // namespace
}  // namespace dynfilter::testing
