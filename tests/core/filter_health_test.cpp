// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/filter_health.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "support/byte_source.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

constexpr double infinite_value = std::numeric_limits<double>::infinity();

/// One frame as the filter leaves it. Depth is 1 m in the left half of the image, missing in the
/// right one.
struct HealthFrame {
  FrameView view;
  std::vector<cv::Point2f> features;
  FrameStatistics statistics;

  explicit HealthFrame(int width = 640) {
    view.depth = cv::Mat(48, width, CV_16UC1, cv::Scalar(1000));
    view.depth(cv::Rect(width / 2, 0, width - width / 2, 48)).setTo(0);
    view.metres_per_unit = 0.001;
    add_features(300, 0);
  }

  void add_features(int with_depth, int without) {
    for (int i = 0; i < with_depth + without; ++i) {
      features.emplace_back(i < with_depth ? 1.0F : static_cast<float>(view.depth.cols - 2), 5.0F);
    }
    statistics.features = features.size();
  }

  void set_masks(double age_s) {
    statistics.has_segmentation = true;
    statistics.segmentation_age_s = age_s;
  }

  void add_gap(double gap_px) {
    statistics.instances.emplace_back();
    statistics.instances.back().mask_gap_px = gap_px;
    statistics.instances.back().mask_gap_places = 20;
  }
};

void add(FilterHealth& health, const HealthFrame& frame) {
  health.add(frame.view, frame.features, frame.statistics);
}

/// Options under which one frame tells.
FilterHealthOptions of_one_frame() {
  FilterHealthOptions options;
  options.min_frames = 1;
  return options;
}

/// Report on one frame.
template <class Change>
FilterHealthReport report_on(const Change& change) {
  HealthFrame frame;
  change(frame);
  FilterHealth health(of_one_frame());
  add(health, frame);
  return health.report();
}

HealthFrame random_frame(ByteSource& source) {
  const int widths[] = {320, 640, 1280};
  HealthFrame frame(widths[source.between(0, 2)]);
  frame.features.clear();
  frame.add_features(source.between(0, 500), source.between(0, 300));
  if (source.chance(10)) frame.view.depth = cv::Mat();
  if (source.chance(80)) frame.set_masks((source.between(0, 500) - 250) * 0.005);
  for (int k = source.between(0, 3); k > 0; --k) frame.add_gap(source.between(0, 70) * 0.5);
  if (source.chance(30)) frame.statistics.instances.emplace_back();  // its gap is not known
  frame.statistics.masked =
      static_cast<std::size_t>(source.between(0, static_cast<int>(frame.statistics.features)));
  frame.statistics.starved = source.chance(5);
  frame.statistics.suggested_features = frame.statistics.starved ? 700 : 0;
  return frame;
}

/// Recounts all frames from the statement of each measure, without tallies.
FilterHealthReport recount(const std::vector<HealthFrame>& frames) {
  const FilterHealthOptions options;
  std::vector<double> ages, gaps, starved, depths;
  FilterHealthReport report;
  for (const HealthFrame& frame : frames) {
    const FrameStatistics& s = frame.statistics;
    const double age_s = std::abs(s.segmentation_age_s);
    if (s.has_segmentation && age_s <= options.max_age_s) ages.push_back(age_s);
    if (s.has_segmentation && age_s > options.max_age_s) ++report.untimed_frames;
    bool has_gap = false;
    for (const InstanceStatistics& instance : s.instances) {
      if (frame.view.depth.empty() || instance.mask_gap_places == 0) continue;
      has_gap = true;
      const double at_640 = instance.mask_gap_px * 640 / frame.view.depth.cols;
      gaps.push_back(std::min(32.0, std::floor(at_640 * 2 + 0.5) / 2));
    }
    report.mask_gap_px.frames += has_gap ? 1 : 0;
    if (!frame.view.depth.empty() && !frame.features.empty()) ++report.without_depth_share.frames;
    for (const cv::Point2f& feature : frame.features) {
      if (frame.view.depth.empty()) continue;
      depths.push_back(feature.x < static_cast<float>(frame.view.depth.cols) / 2 ? 0 : 1);
    }
    const bool is_starved = s.starved || s.features - s.masked < 200;
    starved.push_back(is_starved ? 1 : 0);
    if (!is_starved) continue;
    std::size_t needed = 4 * s.features;  // or fewer, if the same share of them suffices
    for (std::size_t n = 0; n < needed; ++n) {
      if (n * (s.features - s.masked) >= 200 * s.features) needed = n;
    }
    if (s.features == 0) needed = 200;
    report.suggested_features = std::max({report.suggested_features, needed, s.suggested_features});
  }
  const auto mean = [](const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  };
  std::sort(gaps.begin(), gaps.end());
  report.mask_age_s = {mean(ages), HealthVerdict::not_known, ages.size()};
  report.mask_gap_px.value = gaps[gaps.size() / 2];
  report.without_depth_share.value = mean(depths);
  report.starved_share = {mean(starved), HealthVerdict::not_known, frames.size()};
  return report;
}

void expect_equal(const HealthMeasure& got, const HealthMeasure& want, const char* name) {
  ASSERT_TRUE(got.value) << name;
  EXPECT_NEAR(*got.value, *want.value, 1e-12) << name;
  EXPECT_EQ(got.frames, want.frames) << name;
}

TEST(FilterHealth, TalliesEqualARecountOfAllFrames) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    ByteSource source(seed);
    FilterHealth health;
    std::vector<HealthFrame> frames;
    for (int i = 0; i < 40; ++i) {
      frames.push_back(random_frame(source));
      add(health, frames.back());
    }
    const FilterHealthReport got = health.report(), want = recount(frames);
    EXPECT_EQ(got.frames, 40U);
    EXPECT_EQ(got.untimed_frames, want.untimed_frames);
    EXPECT_EQ(got.suggested_features, want.suggested_features) << seed;
    expect_equal(got.mask_age_s, want.mask_age_s, "mask_age_s");
    expect_equal(got.mask_gap_px, want.mask_gap_px, "mask_gap_px");
    expect_equal(got.without_depth_share, want.without_depth_share, "without_depth_share");
    expect_equal(got.starved_share, want.starved_share, "starved_share");
  }
}

TEST(FilterHealth, EveryMeasureNeedsItsFrames) {
  HealthFrame frame;
  frame.set_masks(0);
  frame.add_gap(1);
  FilterHealth health;
  for (std::size_t frames = 1; frames <= 10; ++frames) {
    add(health, frame);
    health.note_depth_offset(0, frames);
    const FilterHealthReport report = health.report();
    for (const HealthMeasure& measure :
         {report.depth_frames_late, report.mask_age_s, report.mask_gap_px,
          report.without_depth_share, report.starved_share}) {
      EXPECT_EQ(measure.frames, frames);
      EXPECT_EQ(measure.value.has_value(), frames == 10);
      EXPECT_EQ(measure.verdict, frames == 10 ? HealthVerdict::good : HealthVerdict::not_known);
    }
  }
}

/// Expects good up to the first limit, look up to the second, and bad beyond.
void expect_flips(const std::function<HealthVerdict(double)>& verdict, double max_good,
                  double above_good, double max_look, double above_look) {
  EXPECT_EQ(verdict(max_good), HealthVerdict::good);
  EXPECT_EQ(verdict(above_good), HealthVerdict::look);
  EXPECT_EQ(verdict(max_look), HealthVerdict::look);
  EXPECT_EQ(verdict(above_look), HealthVerdict::bad);
}

TEST(FilterHealth, OffsetFlipsAtItsLimitsInBothDirections) {
  const auto verdict = [](double frames_late) {
    FilterHealth health;
    health.note_depth_offset(5, 99);  // replaced
    health.note_depth_offset(frames_late, 10);
    return health.report().depth_frames_late.verdict;
  };
  expect_flips(verdict, 0.25, std::nextafter(0.25, 1), 0.5, std::nextafter(0.5, 1));
  expect_flips(verdict, -0.25, std::nextafter(-0.25, -1), -0.5, std::nextafter(-0.5, -1));
}

TEST(FilterHealth, SuggestsTheFeaturesOfTheHungriestFrame) {
  FilterHealth health;
  HealthFrame frame;
  for (const std::size_t masked : {0U, 150U, 200U, 100U}) {  // 300, 150, 100 and 200 left
    frame.statistics.masked = masked;
    add(health, frame);
  }
  EXPECT_EQ(health.report().suggested_features, 600U);
  frame.statistics.starved = true;  // by a floor of the host's
  frame.statistics.suggested_features = 900;
  add(health, frame);
  EXPECT_EQ(health.report().suggested_features, 900U);
}

TEST(FilterHealth, RefusesOptionsOutOfRange) {
  const auto expect_refused = [](const auto& change, const char* name) {
    FilterHealthOptions options;
    change(options);
    expect_error<std::invalid_argument>([&] { FilterHealth{options}; }, name);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const HealthLimits bad : {HealthLimits{-1, 1}, HealthLimits{2, 1}, HealthLimits{nan, 1},
                                 HealthLimits{0, nan}, HealthLimits{0, infinite_value}}) {
    expect_refused([&](auto& o) { o.depth_frames_late = bad; }, "depth_frames_late");
    expect_refused([&](auto& o) { o.mask_age_s = bad; }, "mask_age_s");
    expect_refused([&](auto& o) { o.mask_gap_px = bad; }, "mask_gap_px");
    expect_refused([&](auto& o) { o.without_depth_share = bad; }, "without_depth_share");
    expect_refused([&](auto& o) { o.starved_share = bad; }, "starved_share");
  }
  expect_refused([](auto& o) { o.without_depth_share = {0.5, 1.1}; }, "without_depth_share");
  expect_refused([](auto& o) { o.starved_share = {0.5, 1.1}; }, "starved_share");
  FilterHealthOptions whole;
  whole.without_depth_share = whole.starved_share = {1, 1};
  whole.max_age_s = 0;
  EXPECT_NO_THROW(FilterHealth{whole});
  expect_refused([](auto& o) { o.max_age_s = -1; }, "max_age_s");
  expect_refused([&](auto& o) { o.max_age_s = nan; }, "max_age_s");
  expect_refused([](auto& o) { o.max_age_s = infinite_value; }, "max_age_s");
  expect_refused([](auto& o) { o.min_frames = 0; }, "min_frames");
}

TEST(FilterHealth, RefusesMalformedInputAndStaysAsItWas) {
  FilterHealth health;
  HealthFrame frame;
  frame.statistics.features = 7;
  expect_error<std::invalid_argument>([&] { add(health, frame); },
                                      "FilterHealth: got statistics of 7 features");
  frame = HealthFrame();
  frame.view.metres_per_unit = 0;
  expect_error<std::invalid_argument>([&] { add(health, frame); }, "metres_per_unit");
  expect_error<std::invalid_argument>([&] { health.note_depth_offset(infinite_value, 20); },
                                      "frames_late = inf");
  EXPECT_EQ(health.report().frames, 0U);
  EXPECT_EQ(health.report().depth_frames_late.frames, 0U);
}

}  // namespace
}  // namespace dynfilter::testing
