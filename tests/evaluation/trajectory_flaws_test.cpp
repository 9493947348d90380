// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Trajectory files with flaws that occur in TUM's own recordings.

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/evaluation/trajectory.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter {
namespace {

using testing::expect_error;
using testing::TemporaryFolder;

TrajectoryFile read(const std::string& text) {
  const TemporaryFolder folder;
  return read_trajectory_file(folder.write("t.txt", text));
}

void expect_rows(const FlawedRows& rows, std::size_t count, std::size_t first_line) {
  EXPECT_EQ(rows.count, count);
  EXPECT_EQ(rows.first_line, first_line);
}

TEST(TrajectoryFlaws, RowsWithNanAreSkippedInEveryColumn) {
  for (int column = 0; column < 8; ++column) {
    for (const char* nan : {"nan", "NaN", "-nan", "+NAN"}) {
      SCOPED_TRACE(nan + std::string(" in column ") + std::to_string(column));
      std::string row;
      for (int k = 0; k < 8; ++k)
        row += (k == column ? nan : k == 7 ? "1" : "0") + std::string(" ");
      const TrajectoryFile file =
          read("# t\n1 0 0 0 0 0 0 1\n" + row + "\n3 5 0 0 0 0 0 1\n" + row + "\n");
      ASSERT_EQ(file.trajectory.size(), 2U);
      EXPECT_EQ(file.trajectory[1].translation.x(), 5);
      expect_rows(file.flaws.not_a_number, 2, 3);
      EXPECT_TRUE(file.flaws.any());
    }
  }
}

// The ground truth of fr3_walking_static has such rows: its lines 2456 and 2457 have one time.
TEST(TrajectoryFlaws, LastRowOfARepeatedTimeWins) {
  const TrajectoryFile file = read(
      "1341846251.4487 1 0 0 0 0 0 1\n"
      "1341846251.4587 2 0 0 0 0 0 1\n"
      "1341846251.4587 3 0 0 0 0 0 1\n"
      "1341846251.4687 4 0 0 0 0 0 1\n"
      "1341846251.4587 5 0 0 0 0 0 1\n");
  ASSERT_EQ(file.trajectory.size(), 3U);
  EXPECT_EQ(file.trajectory[1].translation.x(), 5);
  expect_rows(file.flaws.repeated_time, 2, 3);
  expect_rows(file.flaws.time_goes_back, 1, 5);
}

TEST(TrajectoryFlaws, RowsOutOfOrderAreSortedAndCounted) {
  const TrajectoryFile file = read(
      "3 3 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n\n0 0 0 0 0 0 0 1\n"
      "9 9 9 9 0 0 0 0\n9 0 0 0 0.0 -0 0e5 .0\n");
  ASSERT_EQ(file.trajectory.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(file.trajectory[i].timestamp_s, static_cast<double>(i));
    EXPECT_EQ(file.trajectory[i].translation.x(), static_cast<double>(i));
  }
  expect_rows(file.flaws.time_goes_back, 2, 2);
  expect_rows(file.flaws.repeated_time, 0, 0);
  expect_rows(file.flaws.zero_quaternion, 2, 6);
}

TEST(TrajectoryFlaws, RefusesAFileWithoutUsableRows) {
  const TemporaryFolder folder;
  const auto expect_refused = [&](const std::string& text, const std::string& message) {
    const auto path = folder.write("t.txt", text);
    expect_error<std::runtime_error>([&] { read_trajectory_file(path); }, path.string() + message);
  };
  expect_refused("", ": holds no usable pose");
  expect_refused("# no row\n\n", ": holds no usable pose");
  expect_refused("nan 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 0\n1 0 0 nan 0 0 0 1\n",
                 ": holds no usable pose; of its rows, 2 have NaN, 1 a zero quaternion");
}

/// Rows that evaluate_rpe.py keeps, time to x; the map stands for its Python dictionary, which it
/// sorts.
std::map<double, double> kept_by_tum(const std::vector<std::array<double, 3>>& rows) {
  std::map<double, double> kept;
  for (const auto& [time, x, qw] : rows) {
    if (qw == 0 || std::isnan(time) || std::isnan(x)) continue;
    kept[time] = x;
  }
  return kept;
}

TEST(TrajectoryFlaws, AreHandledLikeTumsScripts) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  std::mt19937 random(16);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::array<double, 3>> rows = {{0.5, -1, 1}};
    std::ostringstream text;
    text << "0.5 -1 0 0 0 0 0 1\n";
    for (int i = 0; i < 30; ++i) {
      const double time = random() % 8 == 0 ? nan : static_cast<double>(random() % 40);
      const double x = random() % 8 == 0 ? nan : i;
      rows.push_back({time, x, random() % 8 == 0 ? 0.0 : 1.0});
      text << time << ' ' << x << " 0 0 0 0 0 " << rows.back()[2] << '\n';
    }
    const TrajectoryFile file = read(text.str());
    std::map<double, double> ours;
    for (const TimedPose& pose : file.trajectory) ours[pose.timestamp_s] = pose.translation.x();
    ASSERT_EQ(ours, kept_by_tum(rows)) << text.str();
    const TrajectoryFlaws& flaws = file.flaws;
    EXPECT_EQ(rows.size(), file.trajectory.size() + flaws.not_a_number.count +
                               flaws.zero_quaternion.count + flaws.repeated_time.count);
  }
}

}  // namespace
}  // namespace dynfilter
