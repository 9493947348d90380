// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_TRAJECTORY_HPP
#define DYNFILTER_EVALUATION_TRAJECTORY_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/text_table.hpp"

namespace dynfilter {

/// Where the camera was at a time: a point p of the camera lies at rotation * p + translation in
/// the world. Header-only code only: Eigen's alignment depends on the flags of who compiles it.
struct TimedPose {
  double timestamp_s = 0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres
};

/// Poses in the order of their times, which are distinct.
using Trajectory = std::vector<TimedPose>;

namespace detail {

inline TimedPose read_pose(const TableReader& table) {
  TimedPose pose;
  pose.timestamp_s = table.time(0);
  pose.translation = {table.number(1, "tx"), table.number(2, "ty"), table.number(3, "tz")};
  const Eigen::Quaterniond quaternion(table.number(7, "qw"), table.number(4, "qx"),
                                      table.number(5, "qy"), table.number(6, "qz"));
  // Files have as few as four decimals; farther from 1, the columns mean something else.
  if (!(std::abs(quaternion.norm() - 1) <= 0.1)) {
    table.fail(concatenate("a quaternion of length ", quaternion.norm(), "; want length 1"));
  }
  pose.rotation = quaternion.normalized().toRotationMatrix();
  return pose;
}

/// One row of a trajectory file. Throws std::invalid_argument, in the name of `component`, for a
/// pose that read_trajectory would refuse. 1e-3 leaves room for rotations in single precision.
inline std::string pose_text(const TimedPose& pose, const char* component) {
  const Eigen::Matrix3d& rotation = pose.rotation;
  const double error = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm();
  if (!(error < 1e-3) || !(rotation.determinant() > 0)) {
    throw_misuse(component, "a rotation that is not orthonormal", "a rotation matrix");
  }
  if (!is_time_in_seconds(pose.timestamp_s) || !pose.translation.allFinite()) {
    throw_misuse(component,
                 concatenate("time ", pose.timestamp_s, " s, translation (",
                             pose.translation.transpose(), ")"),
                 "a time in seconds and finite metres");
  }
  Eigen::Quaterniond quaternion = Eigen::Quaterniond(rotation).normalized();
  if (quaternion.w() < 0) quaternion.coeffs() = -quaternion.coeffs();  // one sign of the two
  std::string text = time_text(pose.timestamp_s);
  for (int i = 0; i < 3; ++i) text += ' ' + fixed_decimals(pose.translation(i), 7);
  for (int i = 0; i < 4; ++i) text += ' ' + fixed_decimals(quaternion.coeffs()(i), 9);
  return text;
}

}  // namespace detail

/// Reads a trajectory in the format of the TUM RGB-D benchmark: rows of `timestamp tx ty tz qx qy
/// qz qw`, seconds and metres, camera to world, scalar last; `#` comments, blank lines and CR LF
/// are accepted. Rows that are not in the order of their times are put there; quaternions are
/// normalised. A file without rows is an empty trajectory. Throws std::runtime_error that names
/// file and line for a file that cannot be read, a row that has not 8 columns, a value that is not
/// a finite number, a quaternion whose length is not 1 (beyond 10 %: zero, or other columns), and a
/// time that occurs twice. O(n log n).
inline Trajectory read_trajectory(const std::filesystem::path& path) {
  detail::TableReader table(path);
  std::vector<std::pair<std::size_t, TimedPose>> rows;  // line, pose
  while (table.next()) {
    constexpr const char* columns = "8: timestamp tx ty tz qx qy qz qw";
    table.require_columns(8, columns);
    if (table.columns() > 8) {
      table.fail(detail::concatenate("got ", table.columns(), " columns; want ", columns));
    }
    rows.emplace_back(table.line(), detail::read_pose(table));
  }
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) {
    return a.second.timestamp_s < b.second.timestamp_s;
  });
  Trajectory trajectory;
  trajectory.reserve(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TimedPose& pose = rows[i].second;
    if (i > 0 && detail::microseconds(pose.timestamp_s) ==
                     detail::microseconds(trajectory.back().timestamp_s)) {
      table.fail_at(rows[i].first,
                    detail::concatenate("time ", detail::time_text(pose.timestamp_s),
                                        " stands in line ", rows[i - 1].first, " already"));
    }
    trajectory.push_back(pose);
  }
  return trajectory;
}

/// Writes a trajectory in the same format: times with 6 decimals, positions with 7, quaternions
/// with 9 and a scalar that is not negative, no comment, no trailing blank. Replaces a file that
/// exists. Throws std::invalid_argument for a pose that is not finite, a rotation that is not
/// orthonormal to 1e-3, and times that do not increase by a microsecond at least, before the file
/// is touched; std::runtime_error that names the file when it cannot be written.
inline void write_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  std::vector<std::string> rows;
  rows.reserve(trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    rows.push_back(detail::pose_text(trajectory[i], "write_trajectory"));
    if (i > 0 && detail::microseconds(trajectory[i].timestamp_s) <=
                     detail::microseconds(trajectory[i - 1].timestamp_s)) {
      detail::throw_misuse("write_trajectory",
                           "time " + detail::time_text(trajectory[i].timestamp_s) + " after " +
                               detail::time_text(trajectory[i - 1].timestamp_s),
                           "times that increase");
    }
  }
  detail::TableWriter file(path);
  for (const std::string& row : rows) file.line(row);
  file.close();
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_TRAJECTORY_HPP
