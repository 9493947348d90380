// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "io/health_line.hpp"

#include <gtest/gtest.h>

namespace dynfilter::testing {
namespace {

TEST(HealthLine, NamesTheWorstFirst) {
  FilterHealthReport report;
  EXPECT_EQ(detail::health_line(report), "health: not known yet");
  report.starved_share = {0.01, HealthVerdict::good, 20};
  EXPECT_EQ(detail::health_line(report), "health: good");
  report.depth_frames_late = {-0.3, HealthVerdict::look, 20};
  report.starved_share = {0.25, HealthVerdict::bad, 20};
  EXPECT_EQ(detail::health_line(report),
            "health: starved frames 25.0 %, bad; depth later than colour -0.30 frames, look");
}

}  // namespace
}  // namespace dynfilter::testing
