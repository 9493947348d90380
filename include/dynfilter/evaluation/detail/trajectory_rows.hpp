// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rows of trajectory files. This part is compiled, so it avoids Eigen: library and host may compile
// Eigen with different flags.

#ifndef DYNFILTER_EVALUATION_DETAIL_TRAJECTORY_ROWS_HPP
#define DYNFILTER_EVALUATION_DETAIL_TRAJECTORY_ROWS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/trajectory_flaws.hpp"

namespace dynfilter::detail {

/// Row as in the file: the quaternion's length is 1 within 10 %.
struct TrajectoryRow {
  double timestamp_s = 0;
  std::array<double, 3> translation{};  ///< metres
  std::array<double, 4> quaternion{};   ///< x, y, z, w
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
std::string trajectory_row_text(double timestamp_s, const cv::Matx33d& rotation,
                                const cv::Vec3d& translation, const char* component);

/// Writes the rows. Throws std::runtime_error that names the file if it cannot be written.
void write_trajectory_rows(const std::filesystem::path& path, const std::vector<std::string>& rows);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_EVALUATION_DETAIL_TRAJECTORY_ROWS_HPP
