// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/trajectory_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/text_table.hpp"

namespace dynfilter::detail {
namespace {

constexpr double kitti_frame_s = 0.1;  // KITTI's odometry has ten frames a second

/// What the rows of a file hold, by the columns of the first.
enum class Form { tum, euroc, kitti };

constexpr std::size_t euroc_columns = 17;  // also velocity and biases
constexpr std::size_t kitti_columns = 12;  // the upper rows of a 4x4 matrix

Form form_of(const TableReader& table, std::size_t columns) {
  constexpr const char* want =
      "8: timestamp tx ty tz qx qy qz qw; or EuRoC's 17 in each row, or KITTI's 12";
  if (columns == kitti_columns) {
    if (table.columns() == columns) return Form::kitti;
    table.fail(concatenate("got ", table.columns(), " columns; want KITTI's 12 as above"));
  }
  table.require_columns(8, want);
  const bool is_euroc = columns == euroc_columns;
  if (table.columns() != columns || (columns > 8 && !is_euroc)) {
    table.fail(concatenate("got ", table.columns(), " columns; want ", want));
  }
  // EuRoC's and TUM-VI's motion capture has eight columns, too.
  const bool is_csv = table.has_separator() && parse_number(table.text(0)).value_or(0) >= 1e17;
  return is_euroc || is_csv ? Form::euroc : Form::tum;
}

/// Tells whether Python's float(), which TUM's scripts use, reads the cell as NaN.
bool is_nan(const std::string& cell) {
  const std::size_t sign = !cell.empty() && (cell[0] == '+' || cell[0] == '-') ? 1 : 0;
  const std::string rest = cell.substr(sign);
  return rest.size() == 3 && (rest[0] | 0x20) == 'n' && (rest[1] | 0x20) == 'a' &&
         (rest[2] | 0x20) == 'n';
}

/// Reads the numbers of a row; none if one is NaN.
std::vector<double> read_numbers(const TableReader& table, Form form) {
  static const std::vector<const char*> poses = {"time", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  static const std::vector<const char*> matrices = {"r11", "r12", "r13", "tx",  "r21", "r22",
                                                    "r23", "ty",  "r31", "r32", "r33", "tz"};
  std::vector<double> numbers;
  bool has_nan = false;
  for (const char* name : form == Form::kitti ? matrices : poses) {
    const std::size_t k = numbers.size();
    const bool is_time = k == 0 && form != Form::kitti;
    const bool is_number = !is_nan(table.text(k));
    numbers.push_back(!is_number ? 0 : is_time ? table.time(k) : table.number(k, name));
    has_nan = has_nan || !is_number;
  }
  return has_nan ? std::vector<double>() : numbers;
}

/// Tells whether the matrix is a rotation; the limit 1e-3 admits rotations in single precision.
bool is_rotation(const cv::Matx33d& matrix) {
  return cv::norm(matrix.t() * matrix - cv::Matx33d::eye()) < 1e-3 && cv::determinant(matrix) > 0;
}

/// Returns x y z w of a rotation, with w >= 0, which picks one of the two signs. The first
/// component computed is one that is not near zero, because the others are divided by it.
/// (Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985.)
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

/// Returns the rotation of a quaternion x y z w of length 1.
cv::Matx33d rotation_of(const cv::Vec4d& q) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
}

/// Returns the pose in KITTI's row of numbers, which has no time.
TrajectoryRow matrix_row(const TableReader& table, const std::vector<double>& m, double time_s) {
  const cv::Matx33d rotation(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
  if (!is_rotation(rotation)) {
    table.fail("the matrix of KITTI's 12 columns is no rotation; want r11 r12 r13 tx r21 …");
  }
  return {time_s, rotation_of(quaternion_of(rotation)), {m[3], m[7], m[11]}, table.line()};
}

/// Reads the current row; std::nullopt for a row to skip, which is counted in `flaws`.
std::optional<TrajectoryRow> read_row(const TableReader& table, Form form, double index_time_s,
                                      TrajectoryFlaws& flaws) {
  const std::vector<double> n = read_numbers(table, form);
  if (n.empty()) {
    flaws.not_a_number.add(table.line());
    return {};
  }
  if (form == Form::kitti) return matrix_row(table, n, index_time_s);
  const cv::Vec4d q =
      form == Form::euroc ? cv::Vec4d(n[5], n[6], n[7], n[4]) : cv::Vec4d(n[4], n[5], n[6], n[7]);
  const double length = cv::norm(q);
  if (length == 0) {
    flaws.zero_quaternion.add(table.line());
    return {};
  }
  // Files have as few as four decimals. Farther from 1, the columns mean something else.
  if (!(std::abs(length - 1) <= 0.1)) {
    table.fail(concatenate("a quaternion of length ", length, "; want length 1"));
  }
  return TrajectoryRow{n[0], rotation_of(q / length), {n[1], n[2], n[3]}, table.line()};
}

std::int64_t time_of(const TrajectoryRow& row) { return microseconds(row.timestamp_s); }

/// Reads the usable rows, in the order of the file.
std::vector<TrajectoryRow> read_usable_rows(TableReader& table, TrajectoryRows& read) {
  TrajectoryFlaws& flaws = read.flaws;
  std::vector<TrajectoryRow> rows;
  std::vector<double> times;
  std::size_t columns = 0;
  for (std::size_t index = 0; table.next(); ++index) {
    if (index == 0) columns = table.columns();
    const Form form = form_of(table, columns);
    read.has_times = form != Form::kitti;
    const std::optional<TrajectoryRow> row =
        read_row(table, form, static_cast<double>(index) * kitti_frame_s, flaws);
    if (!row) continue;
    if (!rows.empty() && time_of(*row) < time_of(rows.back())) {
      flaws.time_goes_back.add(row->line);
    }
    rows.push_back(*row);
    times.push_back(row->timestamp_s);
  }
  if (are_too_far_apart(times)) throw_file_error(table.path(), far_apart_text);
  if (rows.empty()) {
    throw_file_error(table.path(),
                     concatenate("holds no usable pose; of its rows, ", flaws.not_a_number.count,
                                 " have NaN, ", flaws.zero_quaternion.count, " a zero quaternion"));
  }
  return rows;
}

}  // namespace

TrajectoryRows read_trajectory_rows(const std::filesystem::path& path) {
  TableReader table(path);
  TrajectoryRows read;
  std::vector<TrajectoryRow> in_order = read_usable_rows(table, read);
  std::stable_sort(in_order.begin(), in_order.end(),
                   [](const auto& a, const auto& b) { return time_of(a) < time_of(b); });
  for (const TrajectoryRow& row : in_order) {
    if (!read.rows.empty() && time_of(row) == time_of(read.rows.back())) {
      read.flaws.repeated_time.add(row.line);
      read.rows.back() = row;
    } else {
      read.rows.push_back(row);
    }
  }
  return read;
}

std::string trajectory_row_text(const TrajectoryRow& row, const char* component) {
  const cv::Vec3d& t = row.translation;
  if (!is_rotation(row.rotation)) {
    throw_misuse(component, "a rotation that is not orthonormal", "a rotation matrix");
  }
  const bool is_finite = std::all_of(t.val, t.val + 3, [](double x) { return std::isfinite(x); });
  if (!is_time_in_seconds(row.timestamp_s) || !is_finite) {
    throw_misuse(
        component,
        concatenate("time ", row.timestamp_s, " s, translation (", t[0], " ", t[1], " ", t[2], ")"),
        "a time in seconds and finite metres");
  }
  const cv::Vec4d quaternion = quaternion_of(row.rotation);
  std::string text = time_text(row.timestamp_s);
  for (int i = 0; i < 3; ++i) text += ' ' + fixed_decimals(t[i], 7);
  for (int i = 0; i < 4; ++i) text += ' ' + fixed_decimals(quaternion[i], 9);
  return text;
}

void write_trajectory_rows(const std::filesystem::path& path,
                           const std::vector<TrajectoryRow>& rows) {
  constexpr const char* component = "write_trajectory";
  std::string text;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    text += trajectory_row_text(rows[i], component) + '\n';
    if (i == 0 || time_of(rows[i]) > time_of(rows[i - 1])) continue;
    throw_misuse(
        component,
        "time " + time_text(rows[i].timestamp_s) + " after " + time_text(rows[i - 1].timestamp_s),
        "times that increase");
  }
  write_file(path, text);
}

}  // namespace dynfilter::detail
