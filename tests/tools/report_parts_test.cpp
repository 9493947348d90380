// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What reports are made of: axes, embedded pictures, line styles, series and times.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "report/html_chart.hpp"
#include "report/html_page.hpp"
#include "report/html_runs.hpp"
#include "report/html_style.hpp"
#include "stopwatch.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::tools {
namespace {

using testing::expect_error;
using testing::TemporaryFolder;

TEST(RoundNumber, IsTheNextOfOneTwoAndFive) {
  for (const auto& [value, rounded] : std::vector<std::pair<double, double>>{
           {1, 1}, {1.01, 2}, {2, 2}, {2.5, 5}, {5, 5}, {5.1, 10}, {300, 500}, {0.03, 0.05}}) {
    EXPECT_NEAR(round_number(value), rounded, 1e-12) << value;
  }
}

TEST(Base64, HasFourDigitsForThreeBytes) {  // the examples of RFC 4648
  const auto of = [](const std::string& text) {
    return base64(std::vector<std::uint8_t>(text.begin(), text.end()));
  };
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of("f"), "Zg==");
  EXPECT_EQ(of("fo"), "Zm8=");
  EXPECT_EQ(of("foo"), "Zm9v");
  EXPECT_EQ(of("foob"), "Zm9vYg==");
  EXPECT_EQ(of("fooba"), "Zm9vYmE=");
  EXPECT_EQ(of("foobar"), "Zm9vYmFy");
}

TEST(RuleStyles, StressThePapersRule) {
  const std::string css = RuleStyles({"mask", "paper", "depth"}).style_sheet();
  EXPECT_NE(css.find("svg .line1 { stroke: var(--text); stroke-width: 2.5; }"), std::string::npos);
  EXPECT_NE(css.find("svg .line0 { stroke: var(--colour0); stroke-dasharray:"), std::string::npos);
  EXPECT_NE(css.find("svg .line2 { stroke: var(--colour1); stroke-dasharray:"), std::string::npos);
}

TEST(FrameSeries, HasScoresOfAllFramesOrNone) {
  const TemporaryFolder folder;
  const auto series_of = [&](const std::string& text) {
    return read_frame_series(folder.write("frames.csv", text));
  };
  const std::string header = "timestamp_s,kept,dynamic_left,static_removed\n";
  const FrameSeries whole = series_of(header + "1,10,3,4\n2,20,5,6\n");
  EXPECT_EQ(whole.times_s, (std::vector<double>{1, 2}));
  EXPECT_EQ(whole.dynamic_left, (std::vector<double>{3, 5}));
  EXPECT_TRUE(series_of(header + "1,10,,\n2,20,,\n").dynamic_left.empty());
  expect_error<std::runtime_error>([&] { series_of(header + "1,10,3,4\n2,20,,\n"); },
                                   "frames.csv: has scores for only some of the frames");
  expect_error<std::runtime_error>([&] { series_of(header); }, "frames.csv: holds no frames");
}

TEST(Times, HaveQuantilesByTheNearestRank) {
  Times times;
  for (const double time_ms : {5.0, 1.0, 4.0, 2.0, 3.0}) times.add(time_ms);
  EXPECT_EQ(times.quantile_ms(0), 1);
  EXPECT_EQ(times.quantile_ms(0.5), 3);
  EXPECT_EQ(times.quantile_ms(0.95), 5);
  EXPECT_EQ(times.quantile_ms(1), 5);
}

}  // namespace
}  // namespace dynfilter::tools
