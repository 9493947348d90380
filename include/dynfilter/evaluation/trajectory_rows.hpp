// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rows of trajectory files and their flaws. This part is compiled, so it avoids Eigen: library and
// host may compile Eigen with different flags.

#ifndef DYNFILTER_EVALUATION_TRAJECTORY_ROWS_HPP
#define DYNFILTER_EVALUATION_TRAJECTORY_ROWS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter {

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

namespace detail {

/// Pose of the camera in the world, in metres.
struct TrajectoryRow {
  double timestamp_s = 0;
  cv::Matx33d rotation;
  cv::Vec3d translation;
  std::size_t line = 0;  ///< of the file; 0: none
};

/// Usable rows of a file in the order of their times, which differ by at least a microsecond.
struct TrajectoryRows {
  std::vector<TrajectoryRow> rows;
  TrajectoryFlaws flaws;
  bool has_times = true;  ///< false: KITTI's, by the number of the frame
};

/// Reads the rows of a trajectory file. Throws like read_trajectory_file.
TrajectoryRows read_trajectory_rows(const std::filesystem::path& path);

/// Returns one row of a trajectory file. Throws std::invalid_argument, in the name of `component`,
/// for a pose that read_trajectory would refuse.
std::string trajectory_row_text(const TrajectoryRow& row, const char* component);

/// Writes a trajectory file. Throws like write_trajectory.
void write_trajectory_rows(const std::filesystem::path& path,
                           const std::vector<TrajectoryRow>& rows);

}  // namespace detail
}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_TRAJECTORY_ROWS_HPP
