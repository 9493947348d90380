// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_TRAJECTORY_HPP
#define DYNFILTER_EVALUATION_TRAJECTORY_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/detail/trajectory_rows.hpp"
#include "dynfilter/evaluation/trajectory_flaws.hpp"

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

inline TimedPose pose_of(const TrajectoryRow& row) {
  const auto& [x, y, z, w] = row.quaternion;
  TimedPose pose;
  pose.timestamp_s = row.timestamp_s;
  pose.rotation = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  pose.translation = Eigen::Map<const Eigen::Vector3d>(row.translation.data());
  return pose;
}

inline std::string row_text(const TimedPose& pose, const char* component) {
  const Eigen::Matrix3d& r = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return trajectory_row_text(
      pose.timestamp_s,
      {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)},
      {t.x(), t.y(), t.z()}, component);
}

}  // namespace detail

/// A trajectory as it was read, and what was wrong with its file.
struct TrajectoryFile {
  Trajectory trajectory;
  TrajectoryFlaws flaws;
};

/// Reads a trajectory in the format of the TUM RGB-D benchmark: rows of `timestamp tx ty tz qx qy
/// qz qw`, seconds and metres, camera to world, scalar last; `#` comments, blank lines and CR LF
/// are accepted. Quaternions are normalised.
///
/// Does with flawed rows what evaluate_rpe.py of the benchmark does, and counts them: skips a row
/// with a NaN or a zero quaternion, takes the last row of a repeated time (in whole microseconds),
/// and puts rows whose time goes back in the order of their times.
///
/// Throws std::runtime_error that names file and line for a row that has not 8 columns, a value
/// that is neither a finite number nor NaN, and a quaternion whose length is neither 0 nor 1
/// (beyond 10 %: other columns); one that names the file for a file that cannot be read or has no
/// usable row. O(n log n).
inline TrajectoryFile read_trajectory_file(const std::filesystem::path& path) {
  const detail::TrajectoryRows read = detail::read_trajectory_rows(path);
  TrajectoryFile file;
  file.flaws = read.flaws;
  file.trajectory.reserve(read.rows.size());
  for (const detail::TrajectoryRow& row : read.rows) {
    file.trajectory.push_back(detail::pose_of(row));
  }
  return file;
}

/// Reads a trajectory as read_trajectory_file does, for callers who do not ask for its flaws.
inline Trajectory read_trajectory(const std::filesystem::path& path) {
  return read_trajectory_file(path).trajectory;
}

/// Writes a trajectory in this format: times with 6 decimals, positions with 7, quaternions
/// with 9 and a scalar that is not negative, no comment, no trailing blank. Replaces a file that
/// exists. Throws std::invalid_argument for a pose that is not finite, a rotation that is not
/// orthonormal to 1e-3, and times that do not increase by a microsecond at least, before the file
/// is touched; std::runtime_error that names the file when it cannot be written.
inline void write_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  std::vector<std::string> rows;
  rows.reserve(trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    rows.push_back(detail::row_text(trajectory[i], "write_trajectory"));
    if (i > 0 && detail::microseconds(trajectory[i].timestamp_s) <=
                     detail::microseconds(trajectory[i - 1].timestamp_s)) {
      detail::throw_misuse("write_trajectory",
                           "time " + detail::time_text(trajectory[i].timestamp_s) + " after " +
                               detail::time_text(trajectory[i - 1].timestamp_s),
                           "times that increase");
    }
  }
  detail::write_trajectory_rows(path, rows);
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_TRAJECTORY_HPP
