// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/trajectory_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "io/file_error.hpp"
#include "io/file_writing.hpp"
#include "io/text_table.hpp"

namespace dynfilter::detail {
namespace {

constexpr double kitti_frame_s = 0.1;  // KITTI's odometry has ten frames a second

/// A row and its line number.
struct NumberedRow {
  std::size_t line = 0;
  TrajectoryRow row;

  std::int64_t time() const { return microseconds(row.timestamp_s); }
};

/// What the rows of a file hold, by the columns of the first.
enum class Form { tum, euroc, kitti };

constexpr std::size_t euroc_columns = 17;  // also velocity and biases
constexpr std::size_t kitti_columns = 12;  // the upper rows of a 4x4 matrix

Form form_of(const TableReader& table, std::size_t columns) {
  if (columns == kitti_columns) return Form::kitti;
  constexpr const char* want =
      "8: timestamp tx ty tz qx qy qz qw; or EuRoC's 17 in each row, or KITTI's 12";
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

/// Reads numbers of a row, the first one a time if it is called so; std::nullopt if one is NaN.
template <std::size_t count>
std::optional<std::array<double, count>> read_numbers(const TableReader& table,
                                                      const char* const (&names)[count]) {
  std::array<double, count> numbers{};
  bool has_nan = false;
  for (std::size_t k = 0; k < count; ++k) {
    if (is_nan(table.text(k))) {
      has_nan = true;
    } else {
      const bool is_time = k == 0 && std::string_view(names[0]) == "time";
      numbers[k] = is_time ? table.time(k) : table.number(k, names[k]);
    }
  }
  if (has_nan) return {};
  return numbers;
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

/// Reads KITTI's row: the pose of a frame, without a time.
std::optional<TrajectoryRow> read_matrix(const TableReader& table, double time_s) {
  if (table.columns() != kitti_columns) {
    table.fail(concatenate("got ", table.columns(), " columns; want KITTI's 12 as above"));
  }
  const auto m = read_numbers<12>(
      table, {"r11", "r12", "r13", "tx", "r21", "r22", "r23", "ty", "r31", "r32", "r33", "tz"});
  if (!m) return {};
  const cv::Matx33d rotation((*m)[0], (*m)[1], (*m)[2], (*m)[4], (*m)[5], (*m)[6], (*m)[8], (*m)[9],
                             (*m)[10]);
  if (!is_rotation(rotation)) {
    table.fail("the matrix of KITTI's 12 columns is no rotation; want r11 r12 r13 tx r21 …");
  }
  return TrajectoryRow{time_s, rotation_of(quaternion_of(rotation)), {(*m)[3], (*m)[7], (*m)[11]}};
}

/// Reads the current row; std::nullopt for a row to skip, which is counted in `flaws`.
std::optional<TrajectoryRow> read_row(const TableReader& table, Form form, double index_time_s,
                                      TrajectoryFlaws& flaws) {
  if (form == Form::kitti) {
    const std::optional<TrajectoryRow> row = read_matrix(table, index_time_s);
    if (!row) flaws.not_a_number.add(table.line());
    return row;
  }
  const auto numbers = read_numbers<8>(table, {"time", "tx", "ty", "tz", "qx", "qy", "qz", "qw"});
  if (!numbers) {
    flaws.not_a_number.add(table.line());
    return {};
  }
  const auto& [time_s, tx, ty, tz, q0, q1, q2, q3] = *numbers;
  const cv::Vec4d q = form == Form::euroc ? cv::Vec4d(q1, q2, q3, q0) : cv::Vec4d(q0, q1, q2, q3);
  const double length = cv::norm(q);
  if (length == 0) {
    flaws.zero_quaternion.add(table.line());
    return {};
  }
  // Files have as few as four decimals. Farther from 1, the columns mean something else.
  if (!(std::abs(length - 1) <= 0.1)) {
    table.fail(concatenate("a quaternion of length ", length, "; want length 1"));
  }
  return TrajectoryRow{time_s, rotation_of(q / length), {tx, ty, tz}};
}

/// Reads the usable rows, in the order of the file.
std::vector<NumberedRow> read_usable_rows(TableReader& table, TrajectoryRows& read) {
  TrajectoryFlaws& flaws = read.flaws;
  std::vector<NumberedRow> rows;
  std::vector<double> times;
  std::size_t columns = 0;
  for (std::size_t index = 0; table.next(); ++index) {
    if (index == 0) columns = table.columns();
    const Form form = form_of(table, columns);
    read.has_times = form != Form::kitti;
    const std::optional<TrajectoryRow> row =
        read_row(table, form, static_cast<double>(index) * kitti_frame_s, flaws);
    if (!row) continue;
    const NumberedRow numbered{table.line(), *row};
    if (!rows.empty() && numbered.time() < rows.back().time()) {
      flaws.time_goes_back.add(table.line());
    }
    rows.push_back(numbered);
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
  std::vector<NumberedRow> in_order = read_usable_rows(table, read);
  std::stable_sort(in_order.begin(), in_order.end(),
                   [](const auto& a, const auto& b) { return a.time() < b.time(); });
  read.rows.reserve(in_order.size());
  for (std::size_t i = 0; i < in_order.size(); ++i) {
    if (i > 0 && in_order[i].time() == in_order[i - 1].time()) {
      read.flaws.repeated_time.add(in_order[i].line);
      read.rows.back() = in_order[i].row;
    } else {
      read.rows.push_back(in_order[i].row);
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
                           const std::vector<std::string>& rows) {
  std::string text;
  for (const std::string& row : rows) text += row + '\n';
  write_file(path, text);
}

}  // namespace dynfilter::detail
