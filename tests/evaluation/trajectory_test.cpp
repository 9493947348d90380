// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/trajectory.hpp"

#include <cmath>
#include <limits>
#include <locale>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_data.hpp"

namespace dynfilter {
namespace {

using testing::expect_error;
using testing::file_text;
using testing::TemporaryFolder;

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
    pose.rotation =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized()
            .toRotationMatrix();
    pose.translation = {normal(random), 100 * normal(random), 1e-3 * normal(random)};
    trajectory.push_back(pose);
  }
  return trajectory;
}

void expect_near(const Trajectory& a, const Trajectory& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i].timestamp_s, b[i].timestamp_s, 6e-7);
    EXPECT_LT((a[i].rotation - b[i].rotation).norm(), 1e-8);
    EXPECT_LT((a[i].translation - b[i].translation).norm(), 1e-7);
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

TEST(Trajectory, IsWrittenInTumFormat) {
  const TemporaryFolder folder;
  Trajectory trajectory(2);
  trajectory[0].timestamp_s = 1341846434.710184;
  trajectory[0].translation = {1.5, -2, 1e-9};
  trajectory[1].timestamp_s = 1341846434.746225;
  trajectory[1].rotation = Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  write_trajectory(folder / "t.txt", trajectory);
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
  EXPECT_EQ(trajectory[0].translation, Eigen::Vector3d(-0.1, 0.5, 3));
  EXPECT_TRUE(
      trajectory[0].rotation.isApprox(Eigen::Vector3d(-1, -1, 1).asDiagonal().toDenseMatrix()));
  EXPECT_EQ(trajectory[1].timestamp_s, 3.5);
  EXPECT_TRUE(trajectory[1].rotation.isIdentity());
  EXPECT_TRUE((trajectory[2].rotation.transpose() * trajectory[2].rotation).isIdentity(1e-12));
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
      {"KITTI", "0 0 1 1 1 0 0 2 0 1 0 3\n", 0},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.what);
    const TrajectoryFile file = read_trajectory_file(folder.write("t.txt", c.text));
    ASSERT_EQ(file.trajectory.size(), 1U);
    const TimedPose& pose = file.trajectory[0];
    EXPECT_NEAR(pose.timestamp_s, c.first_s, 1e-6);
    EXPECT_EQ(pose.translation, Eigen::Vector3d(1, 2, 3));
    const Eigen::Matrix3d turn = (Eigen::Matrix3d() << 0, 0, 1, 1, 0, 0, 0, 1, 0).finished();
    EXPECT_TRUE(pose.rotation.isApprox(c.what[0] == 'K' ? turn : Eigen::Matrix3d(turn.transpose())))
        << pose.rotation;
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
    expect_error<std::runtime_error>([&] { read_trajectory(path); }, path.string() + c.message);
  }
}

TEST(Trajectory, RefusesToWriteInvalidPoses) {
  const TemporaryFolder folder;
  const auto expect_refused = [&](const Trajectory& trajectory, const std::string& part) {
    expect_error<std::invalid_argument>([&] { write_trajectory(folder / "t.txt", trajectory); },
                                        part);
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
  trajectory[1].rotation = -Eigen::Matrix3d::Identity();
  expect_refused(trajectory, "not orthonormal");
  trajectory[1].rotation = Eigen::Matrix3d::Identity();
  trajectory[1].translation.x() = std::numeric_limits<double>::quiet_NaN();
  expect_refused(trajectory, "finite metres");
}

TEST(Trajectory, DoesNotDependOnTheLocale) {
  const TemporaryFolder folder;
  std::mt19937 random(5);
  const Trajectory trajectory = random_trajectory(random, 5);
  write_trajectory(folder / "classic.txt", trajectory);
  const std::locale before = std::locale::global(std::locale(std::locale(), new CommaPoint));
  write_trajectory(folder / "comma.txt", trajectory);
  const Trajectory read = read_trajectory(folder / "comma.txt");
  std::locale::global(before);
  EXPECT_EQ(file_text(folder / "comma.txt"), file_text(folder / "classic.txt"));
  expect_near(read, trajectory);
}

class TrajectoryData : public testing::RecordedData {};

TEST_F(TrajectoryData, ReadsTumGroundTruth) {
  const Trajectory fr3 = read_trajectory(data("tum_fr3_walking_halfsphere_50") / "groundtruth.txt");
  ASSERT_EQ(fr3.size(), 3582U);
  EXPECT_EQ(fr3.front().timestamp_s, 1341846434.8269);
  EXPECT_EQ(fr3.front().translation, Eigen::Vector3d(-0.5177, -2.9045, 1.5365));
  const Trajectory fr1 = read_trajectory(data("tum_fr1_xyz_120") / "groundtruth.txt");
  ASSERT_EQ(fr1.size(), 3000U);
  EXPECT_EQ(fr1.back().timestamp_s, 1305031128.7555);
}

}  // namespace
}  // namespace dynfilter
