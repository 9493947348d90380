// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/map_start.hpp"

#include <cstddef>
#include <string>

#include <gtest/gtest.h>

namespace dynfilter::detail {
namespace {

FrameStatistics with(std::size_t features, std::size_t kept) {
  FrameStatistics statistics;
  statistics.features = features;
  statistics.masked = features - kept;
  return statistics;
}

/// Returns what the watch says of frames with these counts, one after another.
std::string said(MapStart& start, std::size_t frames, const FrameStatistics& statistics) {
  std::string all;
  for (std::size_t i = 0; i < frames; ++i) all += start.add(statistics);
  return all;
}

TEST(MapStart, SaysOnceWhatToSetAfterFramesWithTooFewFeatures) {
  MapStart start(501, "TUM3.yaml");
  EXPECT_EQ(said(start, 28, with(700, 320)), "");
  EXPECT_EQ(start.add(with(700, 500)), "");
  // 501 of 700 / 300 as many: 1169.
  EXPECT_EQ(start.add(with(700, 300)),
            "dynfilter: the host cannot begin a map, because none of 30 frames kept the "
            "501 features that it needs (the best kept 500): set ORBextractor.nFeatures in "
            "TUM3.yaml to at least 1200");
  EXPECT_EQ(said(start, 100, with(700, 300)), "");
}

TEST(MapStart, IsSilentOnceAFrameHadEnough) {
  MapStart start(501, "TUM3.yaml");
  EXPECT_EQ(said(start, 29, with(700, 500)), "");
  EXPECT_EQ(start.add(with(700, 501)), "");
  EXPECT_EQ(said(start, 100, with(700, 300)), "");
}

TEST(MapStart, IsSilentIfNothingIsWanted) {
  MapStart start(0, "TUM3.yaml");
  EXPECT_EQ(said(start, 100, with(700, 0)), "");
}

}  // namespace
}  // namespace dynfilter::detail
