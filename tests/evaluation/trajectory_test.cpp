// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/trajectory.hpp"

#include <locale>

#include "dynfilter/detail/rotation.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Decimal comma, as many countries use and a host's program may have set.
struct CommaPoint : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

Trajectory random_trajectory(std::mt19937& random, int length) {
  std::normal_distribution<double> normal;
  Trajectory trajectory;
  for (int i = 0; i < length; ++i) {
    TimedPose pose;
    pose.timestamp_s = 1341846434.710184 + 0.033331 * i;
    pose.rotation = detail::rotation_of_quaternion(
        cv::normalize(cv::Vec4d(normal(random), normal(random), normal(random), normal(random))));
    pose.translation = {normal(random), 100 * normal(random), 1e-3 * normal(random)};
    trajectory.push_back(pose);
  }
  return trajectory;
}

void expect_near(const Trajectory& a, const Trajectory& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i].timestamp_s, b[i].timestamp_s, 6e-7);
    EXPECT_LT(cv::norm(a[i].rotation - b[i].rotation), 1e-8);
    EXPECT_LT(cv::norm(a[i].translation - b[i].translation), 1e-7);
  }
}

TEST(Trajectory, RoundTripKeepsEveryPose) {
  const TemporaryFolder folder;
  std::mt19937 random(3);
  for (int length = 1; length < 20; ++length) {
    const Trajectory trajectory = random_trajectory(random, length);
    write_trajectory(folder / "t.txt", trajectory);
    expect_near(read_trajectory(folder / "t.txt"), trajectory);
  }
}

TEST(Trajectory, IsWrittenInTumFormatInAnyLocale) {
  const TemporaryFolder folder;
  Trajectory trajectory(2);
  trajectory[0].timestamp_s = 1341846434.710184;
  trajectory[0].translation = {1.5, -2, 1e-9};
  trajectory[1].timestamp_s = 1341846434.746225;
  trajectory[1].rotation = detail::rotation_of({0, 0, 1});
  const std::locale before = std::locale::global(std::locale(std::locale(), new CommaPoint));
  write_trajectory(folder / "t.txt", trajectory);
  const Trajectory read = read_trajectory(folder / "t.txt");
  std::locale::global(before);
  expect_near(read, trajectory);
  EXPECT_EQ(file_text(folder / "t.txt"),
            "1341846434.710184 1.5000000 -2.0000000 0.0000000 "
            "0.000000000 0.000000000 0.000000000 1.000000000\n"
            "1341846434.746225 0.0000000 0.0000000 0.0000000 "
            "0.000000000 0.000000000 0.479425539 0.877582562\n");
}

TEST(Trajectory, IsReadWithCommentsBlankLinesAndDosLineEnds) {
  const TemporaryFolder folder;
  const auto path = folder.write("t.txt",
                                 "\xEF\xBB\xBF# timestamp tx\r\n\r\n  \t\r\n"
                                 "3.5 1 2 3 0 0 0 1\r\n"
                                 "# a comment between\r\n"
                                 "  2.5\t-1e-1 .5 +3  0 0 1 0 \r\n"
                                 "4.5 0 0 0 0 0 0.7073 0.7073");
  const Trajectory trajectory = read_trajectory(path);
  ASSERT_EQ(trajectory.size(), 3U);
  EXPECT_EQ(trajectory[0].timestamp_s, 2.5);  // sorted
  EXPECT_EQ(trajectory[0].translation, cv::Vec3d(-0.1, 0.5, 3));
  EXPECT_LT(cv::norm(trajectory[0].rotation - cv::Matx33d(-1, 0, 0, 0, -1, 0, 0, 0, 1)), 1e-12);
  EXPECT_EQ(trajectory[1].timestamp_s, 3.5);
  EXPECT_EQ(trajectory[1].rotation, cv::Matx33d::eye());
  const cv::Matx33d& turn = trajectory[2].rotation;
  EXPECT_LT(cv::norm(turn.t() * turn - cv::Matx33d::eye()), 1e-12);
}

/// Turns by a third around (1, 1, 1), so that no two axes may be swapped.
TEST(Trajectory, ReadsTheFormsOfTumEurocAndKitti) {
  const TemporaryFolder folder;
  const std::string rest = ",1,2,3,0.5,-0.5,-0.5,-0.5";  // EuRoC: the scalar is the first
  const struct {
    const char* what;
    std::string text;
    double first_s;
  } cases[] = {
      {"TUM", "1403636579.763556 1 2 3 0.5 0.5 0.5 -0.5\n", 1403636579.763556},
      {"TUM, commas", "1403636579.763556, 1, 2, 3, 0.5, 0.5, 0.5, -0.5\n", 1403636579.763556},
      {"TUM, semicolons", "1403636579.763556;1;2;3;0.5;0.5;0.5;-0.5\n", 1403636579.763556},
      {"ORB-SLAM3 on EuRoC", "1403636579763555584 1 2 3 0.5 0.5 0.5 -0.5\n", 1403636579.763556},
      {"EuRoC", "#timestamp [ns]\r\n1403636579763555584" + rest + ",0,0,0,0,0,0,0,0,0\r\n",
       1403636579.763556},
      {"TUM-VI", "1403636579763555584" + rest + "\n", 1403636579.763556},
      {"VINS-Fusion", "1403636579763555584" + rest + ",0.1,0.2,0.3,\n", 1403636579.763556},
      {"VINS-Mono after a loop", "1403636579763555584" + rest + ",\n", 1403636579.763556},
      {"KITTI", "0 0 1 1 1 0 0 2 0 1 0 3\n", 0},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.what);
    const TrajectoryFile file = read_trajectory_file(folder.write("t.txt", c.text));
    ASSERT_EQ(file.trajectory.size(), 1U);
    const TimedPose& pose = file.trajectory[0];
    EXPECT_NEAR(pose.timestamp_s, c.first_s, 1e-6);
    EXPECT_EQ(pose.translation, cv::Vec3d(1, 2, 3));
    const cv::Matx33d turn(0, 0, 1, 1, 0, 0, 0, 1, 0);
    EXPECT_LT(cv::norm(pose.rotation - (c.what[0] == 'K' ? turn : turn.t())), 1e-12);
    EXPECT_EQ(file.has_times, c.what[0] != 'K');
  }
  const std::string row = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  EXPECT_EQ(read_trajectory(folder.write("t.txt", row + row + row)).back().timestamp_s, 0.2);
}

TEST(Trajectory, RefusesMalformedRows) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  const struct {
    std::string text, message;
  } cases[] = {
      {good + "2 0 0 0 0 0 0\n", ":2: got 7 columns; want 8"},
      {good + "2 0 0 0 0 0 0 1 0\n", ":2: got 9 columns; want 8"},
      {"1 0 0 0 0 0 0 1 7\n",
       ":1: got 9 columns; want 8: timestamp tx ty tz qx qy qz qw; or EuRoC's 17 in each row, or "
       "KITTI's 12. If the first 8 are these, as OpenVINS and RTAB-Map write them, keep them: "
       "cut "},
      {"1.30503e+09 0 0 0 0 0 0 1\n", ":1: time: '1.30503e+09' has too few digits"},
      {"# c\n\n2/0/0/0/0/0/0/1\n", ":3: got 1 columns; want 8"},
      {"1 0 0 0 0 1 0 0 0 0 -1 0\n", ":1: the matrix of KITTI's 12 columns is no rotation"},
      {"1 0 0 0 0 1 0 0 0 0 1 x\n", ":1: tz: got 'x'"},
      {"1 0 0 0 0 1 0 0 0 0 1 0\n" + good, ":2: got 8 columns; want KITTI's 12"},
      {good + "x 0 0 0 0 0 0 1\n", ":2: time: got 'x'; want a finite number"},
      {good + "inf 0 0 0 0 0 0 1\n", ":2: time: got 'inf'"},
      {"1403636579763555 0 0 0 0 0 0 1\n",
       ":1: time: got '1403636579763555'; want seconds, not microseconds"},
      {"1403636579763 0 0 0 0 0 0 1\n",
       ":1: time: got '1403636579763'; want seconds, not milliseconds"},
      {good + "2 0 0 0,5 0,5 0,5 0,5 0,5\n",
       ":2: tz: got '0,5'; want a finite number, with a decimal"},
      {good + "2 0 inf 0 0 0 0 1\n", ":2: ty: got 'inf'"},
      {good + "2 0 0 1e999 0 0 0 1\n", ":2: tz: got '1e999'"},
      {good + "2 0 0 1,5 0 0 0 1\n", ":2: tz: got '1,5'"},
      {good + "2 0 0 0 0 0 0 0.5\n", ":2: a quaternion of length 0.5; want length 1"},
      {good + "2 0 0 0 0 0 90 1\n", ":2: a quaternion of length 90"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.text);
    const TemporaryFolder folder;
    const auto path = folder.write("t.txt", c.text);
    expect_failure([&] { read_trajectory(path); }, path.string() + c.message);
  }
}

TEST(Trajectory, RefusesToWriteInvalidPoses) {
  const TemporaryFolder folder;
  const auto expect_refused = [&](const Trajectory& trajectory, const std::string& part) {
    expect_misuse([&] { write_trajectory(folder / "t.txt", trajectory); }, part);
    EXPECT_FALSE(std::filesystem::exists(folder / "t.txt"));
  };
  Trajectory trajectory(2);
  expect_refused(trajectory, "time 0.000000 after 0.000000");
  trajectory[1].timestamp_s = 1e-7;  // the same microsecond
  expect_refused(trajectory, "want times that increase");
  trajectory[0].timestamp_s = 2;
  trajectory[1].timestamp_s = 1;
  expect_refused(trajectory, "time 1.000000 after 2.000000");
  trajectory[0].timestamp_s = 0;
  trajectory[1].rotation *= 1.01;
  expect_refused(trajectory, "not orthonormal");
  trajectory[1].rotation = cv::Matx33d::eye() * -1.0;
  expect_refused(trajectory, "not orthonormal");
  trajectory[1].rotation = cv::Matx33d::eye();
  trajectory[1].translation[0] = std::numeric_limits<double>::quiet_NaN();
  expect_refused(trajectory, "finite metres");
}

// --- Flaws that occur in TUM's own recordings ----------------------------------------------------

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
      EXPECT_EQ(file.trajectory[1].translation[0], 5);
      expect_rows(file.flaws.not_a_number, 2, 3);
    }
  }
}

// The ground truth of fr3_walking_static has such rows: its lines 2456 and 2457 have one time.
TEST(TrajectoryFlaws, RowsAreSortedAndTheLastOfARepeatedTimeWins) {
  const TrajectoryFile file = read(
      "3 3 0 0 0 0 0 1\n1 7 0 0 0 0 0 1\n1 8 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n\n0 0 0 0 0 0 0 1\n"
      "9 9 9 9 0 0 0 0\n9 0 0 0 0.0 -0 0e5 .0\n3.5 4 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
  ASSERT_EQ(file.trajectory.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(file.trajectory[i].timestamp_s, i < 4 ? static_cast<double>(i) : 3.5);
    EXPECT_EQ(file.trajectory[i].translation[0], static_cast<double>(i));
  }
  expect_rows(file.flaws.time_goes_back, 3, 2);
  expect_rows(file.flaws.repeated_time, 2, 3);
  expect_rows(file.flaws.zero_quaternion, 2, 7);
}

TEST(TrajectoryFlaws, RefusesAFileWithoutUsableRows) {
  const TemporaryFolder folder;
  const auto expect_refused = [&](const std::string& text, const std::string& message) {
    const auto path = folder.write("t.txt", text);
    expect_failure([&] { read_trajectory_file(path); }, path.string() + message);
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
    for (const TimedPose& pose : file.trajectory) ours[pose.timestamp_s] = pose.translation[0];
    ASSERT_EQ(ours, kept_by_tum(rows)) << text.str();
    const TrajectoryFlaws& flaws = file.flaws;
    EXPECT_EQ(rows.size(), file.trajectory.size() + flaws.not_a_number.count +
                               flaws.zero_quaternion.count + flaws.repeated_time.count);
  }
}

}  // namespace
}  // namespace dynfilter::testing
