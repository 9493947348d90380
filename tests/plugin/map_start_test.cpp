// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/map_start.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Features of a frame, by verdict.
struct Counts {
  std::size_t untouched, compensated, moving, masked;
};

/// Labels as the filter makes them. Of each reason, the least certain ones come last.
FeatureLabels labels_of(const Counts& counts) {
  const std::size_t all = counts.untouched + counts.compensated + counts.moving + counts.masked;
  FeatureLabels labels(all, Segmentation());
  std::size_t i = counts.untouched;
  const auto remove = [&](std::size_t count, Reason reason) {
    for (std::size_t k = 0; k < count; ++k, ++i) {
      labels.remove(i, -1, reason, 1 - static_cast<float>(k) / static_cast<float>(all));
    }
  };
  remove(counts.masked, Reason::in_mask);
  remove(counts.moving, Reason::moving);
  remove(counts.compensated, Reason::compensated);
  return labels;
}

struct MapStartCase {
  const char* name;
  std::vector<Counts> frames;
  std::size_t begins;               // index of the frame; beyond the last one: it does not begin
  std::size_t compensated, moving;  // still removed there
};

const MapStartCase map_start_cases[] = {
    {"enough is left", {{501, 200, 9, 300}, {400, 200, 0, 0}}, 0, 200, 9},
    {"compensation takes too many", {{400, 200, 0, 400}, {400, 200, 0, 400}}, 0, 99, 0},
    {"motion takes too many", {{400, 0, 200, 400}, {400, 0, 200, 400}}, 0, 0, 99},
    {"both do", {{300, 100, 102, 499}, {300, 100, 102, 499}}, 0, 0, 1},
    {"compensated ones come first", {{300, 201, 102, 400}}, 0, 0, 102},
    {"masks take too many", {{300, 100, 100, 500}, {500, 0, 0, 500}}, 2, 0, 0},
    {"enough later",
     {{300, 100, 100, 0}, {9, 0, 0, 0}, {9, 99, 392, 0}, {9, 999, 0, 0}},
     3,
     507,
     0},
};

TEST(MapStart, KeepsTheFirstOfEquals) {
  FeatureLabels labels(502, Segmentation());
  for (const std::size_t i : {500U, 501U}) labels.remove(i, -1, Reason::moving, 0.5F);
  detail::MapStart().keep_for_map(labels);
  EXPECT_FALSE(labels.is_removed(500));
  EXPECT_TRUE(labels.is_removed(501));
}

TEST(MapStart, KeepsWhatIsLeastCertainInTheFrameThatBeginsTheMap) {
  for (const MapStartCase& c : map_start_cases) {
    detail::MapStart start;
    for (const char* time : {"first", "after a reset"}) {
      SCOPED_TRACE(::testing::Message() << c.name << ", " << time);
      for (std::size_t f = 0; f < c.frames.size(); ++f) {
        const Counts& counts = c.frames[f];
        FeatureLabels labels = labels_of(counts);
        start.keep_for_map(labels);
        const std::size_t compensated = f == c.begins ? c.compensated : counts.compensated;
        const std::size_t moving = f == c.begins ? c.moving : counts.moving;
        const std::size_t first_moving = counts.untouched + counts.masked;
        const std::size_t first_compensated = first_moving + counts.moving;
        for (std::size_t i = 0; i < labels.size(); ++i) {
          const bool is_removed = i >= first_compensated ? i < first_compensated + compensated
                                  : i >= first_moving    ? i < first_moving + moving
                                                         : i >= counts.untouched;
          ASSERT_EQ(labels.is_removed(i), is_removed) << "feature " << i << " of frame " << f;
        }
      }
      start.begin_anew();
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
