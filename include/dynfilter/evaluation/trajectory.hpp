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

/// Pose of the camera at a time: a point p in the camera's frame lies at rotation * p + translation
/// in the world. For header-only code, because Eigen's alignment depends on the compiler's flags.
struct TimedPose {
  double timestamp_s = 0;                                  ///< seconds
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< metres
};

/// Poses ordered by their times, which are distinct.
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

/// Trajectory with the flaws of its file.
struct TrajectoryFile {
  Trajectory trajectory;  ///< the usable poses
  TrajectoryFlaws flaws;  ///< what was wrong with the file
  /// Whether the file has times. KITTI's has none: its row i counts as i * 0.1 s.
  bool has_times = true;
};

/// Reads a trajectory, camera to world, metres. Rows are TUM's `timestamp tx ty tz qx qy qz qw`,
/// EuRoC's csv (nanoseconds, scalar first, 17 columns or 8) or KITTI's 12 columns of a matrix.
/// Times of 1e17 and more are nanoseconds. Blanks, commas or semicolons divide columns; `#`
/// comments, blank lines, any ends of lines and UTF-16 are accepted. Quaternions are normalised.
///
/// Flawed rows are treated as by the benchmark's evaluate_rpe.py, and counted: a row with a NaN or
/// a zero quaternion is skipped, the last row of a repeated time (in whole microseconds) counts,
/// and rows whose time goes back are sorted.
///
/// Throws std::runtime_error that names file and line for a row of other columns, a value that is
/// neither a finite number nor NaN, and a quaternion whose length is neither 0 nor 1 (beyond 10 %:
/// other columns). Throws std::runtime_error that names the file if it cannot be read or has no
/// usable row. O(n log n).
inline TrajectoryFile read_trajectory_file(const std::filesystem::path& path) {
  const detail::TrajectoryRows read = detail::read_trajectory_rows(path);
  TrajectoryFile file;
  file.flaws = read.flaws;
  file.has_times = read.has_times;
  file.trajectory.reserve(read.rows.size());
  for (const detail::TrajectoryRow& row : read.rows) {
    file.trajectory.push_back(detail::pose_of(row));
  }
  return file;
}

/// Reads a trajectory like read_trajectory_file, without its flaws.
inline Trajectory read_trajectory(const std::filesystem::path& path) {
  return read_trajectory_file(path).trajectory;
}

/// Writes a trajectory in this format: times with 6 decimals, positions with 7, quaternions with 9
/// and a scalar that is not negative, no comment, no trailing blank. Replaces an existing file.
///
/// Throws std::invalid_argument, before the file is touched, for a pose that is not finite, a
/// rotation that is not orthonormal to 1e-3, and times that do not increase by at least a
/// microsecond. Throws std::runtime_error that names the file if it cannot be written.
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
