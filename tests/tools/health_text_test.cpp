// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The words for a run's health: each trouble has a verdict and a remedy.

#include "tools/health_text.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace dynfilter::testing {
namespace {

using tools::HealthRow;

std::vector<HealthRow> health_rows(const FilterHealthReport& report,
                                   const std::optional<DepthOffsetEstimate>& offset) {
  return tools::health_rows(report, offset, false);
}

DepthOffsetEstimate measured(double frames_late) {
  DepthOffsetEstimate estimate;
  estimate.verdict = DepthOffsetVerdict::measured;
  estimate.offset = DepthOffset{frames_late / 30, 0.001, frames_late, 0.03};
  estimate.frames = 40;
  estimate.period_s = 1 / 30.0;
  return estimate;
}

TEST(DepthOffsetText, CallsAQuarterOfAFrameInStep) {
  const auto says = [](double frames_late, const std::string& words) {
    EXPECT_EQ(tools::depth_offset_text(measured(frames_late)).find(words), 0U) << frames_late;
  };
  says(0, "depth is in step");
  says(0.25, "depth is in step");
  says(-0.25, "depth is in step");
  says(0.26, "depth is late by 0.26 frames");
  says(-0.26, "depth is early by 0.26 frames");
}

HealthMeasure measure(double value, HealthVerdict verdict) { return {value, verdict, 40}; }

/// Report on a sound recording.
FilterHealthReport sound() {
  FilterHealthReport report;
  report.frames = 40;
  report.depth_frames_late = measure(0.03, HealthVerdict::good);
  report.mask_age_s = measure(0, HealthVerdict::good);
  report.mask_gap_px = measure(2, HealthVerdict::good);
  report.without_depth_share = measure(0.125, HealthVerdict::good);
  report.starved_share = measure(0, HealthVerdict::good);
  return report;
}

/// Expects that only measure k has advice, with this verdict and these words.
void expect_advice(const FilterHealthReport& report,
                   const std::optional<DepthOffsetEstimate>& offset, std::size_t k,
                   const std::string& verdict, const std::string& words) {
  const std::vector<HealthRow> rows = health_rows(report, offset);
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[k].verdict, verdict);
  EXPECT_NE(rows[k].advice.find(words), std::string::npos) << rows[k].advice << "\nwant: " << words;
  for (std::size_t other = 0; other < rows.size(); ++other) {
    if (other == k) continue;
    EXPECT_EQ(rows[other].advice, "") << rows[other].name;
    EXPECT_EQ(rows[other].verdict, "good") << rows[other].name;
  }
  ASSERT_EQ(tools::health_advice(rows).size(), 1U);
  EXPECT_NE(tools::health_advice(rows)[0].find(", " + verdict + ": "), std::string::npos);
}

TEST(HealthText, SoundInputNeedsNoAdvice) {
  const std::vector<HealthRow> rows = health_rows(sound(), measured(0.03));
  EXPECT_TRUE(tools::health_advice(rows).empty());
  EXPECT_EQ(tools::text_of(tools::health_table("health", rows)),
            "health\n"
            "                                         value  frames  verdict\n"
            "depth later than colour            0.03 frames      40     good\n"
            "age of the masks                       0.000 s      40     good\n"
            "masks short of the objects' depth       2.0 px      40     good\n"
            "features without depth                  12.5 %      40     good\n"
            "starved frames                           0.0 %      40     good\n");
}

struct Trouble {
  HealthMeasure FilterHealthReport::*which;
  HealthMeasure measure;
  double frames_late;  ///< of the measured offset
  std::vector<const char*> words;
};

TEST(HealthText, EachTroubleHasAVerdictAndARemedy) {
  using Report = FilterHealthReport;
  const HealthVerdict look = HealthVerdict::look, bad = HealthVerdict::bad;
  const std::vector<Trouble> troubles = {
      {&Report::depth_frames_late,
       measure(1, bad),
       1,
       {"depth is late by 1.00 frames", "--depth-offset 0.033 for dynfilter run"}},
      {&Report::depth_frames_late,
       measure(-1, bad),
       -1,
       {"depth is early by 1.00 frames", "--depth-offset -0.033"}},
      {&Report::depth_frames_late, measure(0.4, look), 0.4, {"no other pairs are nearer"}},
      {&Report::mask_age_s,
       measure(0.1, look),
       0,
       {"0.100 s old on average, and objects have moved since", "--rule depth_moved"}},
      {&Report::mask_age_s, measure(0.3, bad), 0, {"objects have left them"}},
      {&Report::mask_age_s, {}, 0, {"too few frames have masks"}},
      {&Report::mask_gap_px,
       measure(4.5, look),
       0,
       {"objects reach 4.5 px beyond their masks", "a larger network", "--margin 5"}},
      {&Report::mask_gap_px, {}, 0, {"rule depth"}},
      {&Report::without_depth_share, measure(0.6, look), 0, {"60 % of the features"}},
      {&Report::without_depth_share, {}, 0, {"too few frames have depth"}},
      {&Report::starved_share,
       measure(0.25, bad),
       0,
       {"25 % of the frames keep fewer than 200 features", "--features 2084"}}};
  constexpr HealthMeasure Report::*measures[] = {&Report::depth_frames_late, &Report::mask_age_s,
                                                 &Report::mask_gap_px, &Report::without_depth_share,
                                                 &Report::starved_share};
  for (const Trouble& trouble : troubles) {
    Report report = sound();
    report.*trouble.which = trouble.measure;
    report.suggested_features = 2084;
    const std::size_t row = static_cast<std::size_t>(
        std::find(std::begin(measures), std::end(measures), trouble.which) - measures);
    const std::string verdict = trouble.measure.verdict == look  ? "look"
                                : trouble.measure.verdict == bad ? "bad"
                                                                 : "not known";
    for (const char* words : trouble.words) {
      expect_advice(report, measured(trouble.frames_late), row, verdict, words);
    }
  }
}

TEST(HealthText, UnknownOffsetSaysWhy) {
  FilterHealthReport report = sound();
  report.depth_frames_late = {};
  expect_advice(report, {}, 0, "not known", "every frame");
  DepthOffsetEstimate still;
  still.verdict = DepthOffsetVerdict::nothing_moves;
  expect_advice(report, still, 0, "not known", "too little moves");
}

TEST(HealthText, RemediesDependOnTheRest) {
  FilterHealthReport report = sound();
  report.mask_age_s = measure(0.3, HealthVerdict::bad);
  const HealthRow moved = tools::health_rows(report, measured(0), true)[1];
  EXPECT_EQ(moved.verdict, "bad") << "moved masks are not fresh";
  EXPECT_EQ(moved.advice.find("depth_moved"), std::string::npos) << moved.advice;
  report.mask_age_s = {{}, HealthVerdict::not_known, 3};
  report.untimed_frames = 37;
  expect_advice(report, measured(0), 1, "not known", "mask_time");

  report = sound();
  report.mask_gap_px = measure(4.5, HealthVerdict::look);
  report.depth_frames_late = measure(1, HealthVerdict::bad);
  const std::string advice = health_rows(report, measured(1))[2].advice;
  EXPECT_NE(advice.find("mend the depth's offset first"), std::string::npos) << advice;
  EXPECT_EQ(advice.find("larger network"), std::string::npos) << advice;
}

}  // namespace
}  // namespace dynfilter::testing
