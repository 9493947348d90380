// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/detail/trajectory_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "../text_table.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"

namespace dynfilter::detail {
namespace {

/// A row and the line that it stands in.
using NumberedRow = std::pair<std::size_t, TrajectoryRow>;

void require_eight_columns(const TableReader& table) {
  constexpr const char* columns = "8: timestamp tx ty tz qx qy qz qw";
  table.require_columns(8, columns);
  if (table.columns() > 8) {
    table.fail(concatenate("got ", table.columns(), " columns; want ", columns));
  }
}

TrajectoryRow read_row(const TableReader& table) {
  require_eight_columns(table);
  TrajectoryRow row;
  row.timestamp_s = table.time(0);
  row.translation = {table.number(1, "tx"), table.number(2, "ty"), table.number(3, "tz")};
  row.quaternion = {table.number(4, "qx"), table.number(5, "qy"), table.number(6, "qz"),
                    table.number(7, "qw")};
  const auto& [x, y, z, w] = row.quaternion;
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  // Files have as few as four decimals; farther from 1, the columns mean something else.
  if (!(std::abs(length - 1) <= 0.1)) {
    table.fail(concatenate("a quaternion of length ", length, "; want length 1"));
  }
  return row;
}

void require_distinct_times(const std::vector<NumberedRow>& sorted, const TableReader& table) {
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const auto& [line, row] = sorted[i];
    const auto& [earlier_line, earlier] = sorted[i - 1];
    if (microseconds(row.timestamp_s) != microseconds(earlier.timestamp_s)) continue;
    table.fail_at(line, concatenate("time ", time_text(row.timestamp_s), " stands in line ",
                                    earlier_line, " already"));
  }
}

/// 1e-3 leaves room for rotations in single precision.
bool is_rotation(const cv::Matx33d& matrix) {
  return cv::norm(matrix.t() * matrix - cv::Matx33d::eye()) < 1e-3 && cv::determinant(matrix) > 0;
}

bool is_finite(const cv::Vec3d& vector) {
  return std::isfinite(vector[0]) && std::isfinite(vector[1]) && std::isfinite(vector[2]);
}

/// x y z w of a rotation, with w not negative: one sign of the two. One that is not near zero is
/// computed first, for the others are divided by it. (Shoemake, "Animating rotation with quaternion
/// curves", SIGGRAPH 1985.)
cv::Vec4d quaternion_of(const cv::Matx33d& rotation) {
  cv::Vec4d quaternion;
  const double trace = cv::trace(rotation);
  if (trace > 0) {
    const double root = std::sqrt(trace + 1);
    quaternion = {rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                  rotation(1, 0) - rotation(0, 1), root * root};
    quaternion *= 0.5 / root;
  } else {
    int i = rotation(1, 1) > rotation(0, 0) ? 1 : 0;
    if (rotation(2, 2) > rotation(i, i)) i = 2;
    const int j = (i + 1) % 3;
    const int k = (j + 1) % 3;
    const double root = std::sqrt(rotation(i, i) - rotation(j, j) - rotation(k, k) + 1);
    quaternion[i] = root * root;
    quaternion[j] = rotation(j, i) + rotation(i, j);
    quaternion[k] = rotation(k, i) + rotation(i, k);
    quaternion[3] = rotation(k, j) - rotation(j, k);
    quaternion *= 0.5 / root;
  }
  quaternion *= 1 / cv::norm(quaternion);
  return quaternion[3] < 0 ? -quaternion : quaternion;
}

}  // namespace

std::vector<TrajectoryRow> read_trajectory_rows(const std::filesystem::path& path) {
  TableReader table(path);
  std::vector<NumberedRow> numbered;
  while (table.next()) numbered.emplace_back(table.line(), read_row(table));
  std::stable_sort(numbered.begin(), numbered.end(), [](const auto& a, const auto& b) {
    return a.second.timestamp_s < b.second.timestamp_s;
  });
  require_distinct_times(numbered, table);
  std::vector<TrajectoryRow> rows;
  rows.reserve(numbered.size());
  for (const NumberedRow& row : numbered) rows.push_back(row.second);
  return rows;
}

std::string trajectory_row_text(double timestamp_s, const cv::Matx33d& rotation,
                                const cv::Vec3d& translation, const char* component) {
  if (!is_rotation(rotation)) {
    throw_misuse(component, "a rotation that is not orthonormal", "a rotation matrix");
  }
  if (!is_time_in_seconds(timestamp_s) || !is_finite(translation)) {
    throw_misuse(component,
                 concatenate("time ", timestamp_s, " s, translation (", translation[0], " ",
                             translation[1], " ", translation[2], ")"),
                 "a time in seconds and finite metres");
  }
  const cv::Vec4d quaternion = quaternion_of(rotation);
  std::string text = time_text(timestamp_s);
  for (int i = 0; i < 3; ++i) text += ' ' + fixed_decimals(translation[i], 7);
  for (int i = 0; i < 4; ++i) text += ' ' + fixed_decimals(quaternion[i], 9);
  return text;
}

void write_trajectory_rows(const std::filesystem::path& path,
                           const std::vector<std::string>& rows) {
  TableWriter file(path);
  for (const std::string& row : rows) file.line(row);
  file.close();
}

}  // namespace dynfilter::detail
