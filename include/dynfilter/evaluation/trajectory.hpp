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

/// Reads a trajectory in the format of the TUM RGB-D benchmark: rows of `timestamp tx ty tz qx qy
/// qz qw`, seconds and metres, camera to world, scalar last; `#` comments, blank lines and CR LF
/// are accepted. Rows that are not in the order of their times are put there; quaternions are
/// normalised. A file without rows is an empty trajectory. Throws std::runtime_error that names
/// file and line for a file that cannot be read, a row that has not 8 columns, a value that is not
/// a finite number, a quaternion whose length is not 1 (beyond 10 %: zero, or other columns), and a
/// time that occurs twice. O(n log n).
inline Trajectory read_trajectory(const std::filesystem::path& path) {
  Trajectory trajectory;
  for (const detail::TrajectoryRow& row : detail::read_trajectory_rows(path)) {
    trajectory.push_back(detail::pose_of(row));
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
