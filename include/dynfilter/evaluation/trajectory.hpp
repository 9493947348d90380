// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_TRAJECTORY_HPP
#define DYNFILTER_EVALUATION_TRAJECTORY_HPP

#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "dynfilter/evaluation/trajectory_rows.hpp"

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

/// Trajectory with the flaws of its file.
struct TrajectoryFile {
  Trajectory trajectory;  ///< the usable poses
  TrajectoryFlaws flaws;  ///< what was wrong with the file
  /// Whether the file has times. KITTI's has none: its row i counts as i * 0.1 s.
  bool has_times = true;
};

/// Reads a trajectory, camera to world, metres. Rows are TUM's `timestamp tx ty tz qx qy qz qw`,
/// EuRoC's csv (nanoseconds, scalar first, 17 columns or 8) or KITTI's 12 columns of a matrix; `#`
/// comments, any separators, ends of lines and UTF-16 are accepted. Flawed rows are treated as by
/// the benchmark's evaluate_rpe.py, and counted: a row with a NaN or a zero quaternion is skipped,
/// the last row of a repeated time (in whole microseconds) counts, and the others are sorted.
///
/// Throws std::runtime_error that names file and line for a row of other columns, a value that is
/// neither a finite number nor NaN, and a quaternion whose length is not 1 within 10 %; and for a
/// file that cannot be read or has no usable row. O(n log n).
inline TrajectoryFile read_trajectory_file(const std::filesystem::path& path) {
  const detail::TrajectoryRows read = detail::read_trajectory_rows(path);
  TrajectoryFile file;
  file.flaws = read.flaws;
  file.has_times = read.has_times;
  for (const detail::TrajectoryRow& row : read.rows) {
    using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    file.trajectory.push_back({row.timestamp_s, Eigen::Map<const Rotation>(row.rotation.val),
                               Eigen::Map<const Eigen::Vector3d>(row.translation.val)});
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
  std::vector<detail::TrajectoryRow> rows;
  for (const TimedPose& pose : trajectory) {
    const Eigen::Matrix3d& r = pose.rotation;
    const Eigen::Vector3d& t = pose.translation;
    rows.push_back(
        {pose.timestamp_s,
         {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)},
         {t.x(), t.y(), t.z()}});
  }
  detail::write_trajectory_rows(path, rows);
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_TRAJECTORY_HPP
