// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "dynfilter/pose.hpp"

namespace dynfilter {

/// Pose of the camera at a time: takes a point of the camera's frame into the world.
struct TimedPose : Pose {
  double timestamp_s = 0;  ///< seconds
};

/// Poses ordered by their times, which are distinct.
using Trajectory = std::vector<TimedPose>;

/// Rows of a file that share one flaw.
struct FlawedRows {
  std::size_t count = 0;       ///< number of rows
  std::size_t first_line = 0;  ///< number of the first such line; 0 = none

  /// Counts one more row. Rows may come in any order.
  void add(std::size_t line) {
    if (count == 0 || line < first_line) first_line = line;
    ++count;
  }
};

/// Flaws of a trajectory file that could be read nevertheless. TUM's own files have such rows.
struct TrajectoryFlaws {
  FlawedRows not_a_number;     ///< a value is NaN; skipped
  FlawedRows zero_quaternion;  ///< qx qy qz qw are all 0; skipped
  FlawedRows repeated_time;    ///< same time as an earlier row, which it replaces
  FlawedRows time_goes_back;   ///< earlier than the row before; sorted by time
};

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
TrajectoryFile read_trajectory_file(const std::filesystem::path& path);

/// Reads a trajectory like read_trajectory_file, without its flaws.
Trajectory read_trajectory(const std::filesystem::path& path);

/// Writes a trajectory in this format: times with 6 decimals, positions with 7, quaternions with 9
/// and a scalar that is not negative, no comment, no trailing blank. Replaces an existing file.
///
/// Throws std::invalid_argument, before the file is touched, for a pose that is not finite, a
/// rotation that is not orthonormal to 1e-3, and times that do not increase by at least a
/// microsecond. Throws std::runtime_error that names the file if it cannot be written.
void write_trajectory(const std::filesystem::path& path, const Trajectory& trajectory);

namespace detail {

/// Returns one row of a trajectory file. Throws std::invalid_argument, in the name of `component`,
/// for a pose that read_trajectory would refuse.
std::string trajectory_row(const TimedPose& pose, const char* component);

}  // namespace detail
}  // namespace dynfilter
