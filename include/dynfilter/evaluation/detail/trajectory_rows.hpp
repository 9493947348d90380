// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rows of trajectory files. This part is compiled, and so knows no Eigen: what the library and
// its host compile of Eigen with other flags must not get mixed up.

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

/// As it stands in the file: the quaternion's length is 1 to 10 %.
struct TrajectoryRow {
  double timestamp_s = 0;
  std::array<double, 3> translation{};  ///< metres
  std::array<double, 4> quaternion{};   ///< x y z w
};

/// A file's usable rows in the order of their times, which differ by a microsecond at least.
struct TrajectoryRows {
  std::vector<TrajectoryRow> rows;
  TrajectoryFlaws flaws;
};

/// Throws as read_trajectory_file.
TrajectoryRows read_trajectory_rows(const std::filesystem::path& path);

/// One row of a trajectory file. Throws std::invalid_argument, in the name of `component`, for a
/// pose that read_trajectory would refuse.
std::string trajectory_row_text(double timestamp_s, const cv::Matx33d& rotation,
                                const cv::Vec3d& translation, const char* component);

/// Throws std::runtime_error that names the file when it cannot be written.
void write_trajectory_rows(const std::filesystem::path& path, const std::vector<std::string>& rows);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_EVALUATION_DETAIL_TRAJECTORY_ROWS_HPP
